#include <cstdio>
#include <scanloc/core/loop_detector.hpp>
int main() {
  auto detector = scanloc::LoopDetector::Create({.window_s = 30.0});
  if (!detector.ok()) return std::fprintf(stderr, "%s\n", detector.status().ToString().c_str()), 1;
  const Eigen::Matrix2Xd posts = Eigen::Matrix2Xd::Random(2, 120) * 50.0;  // of a made square [m]
  for (int i = 0; i < 90; ++i) {  // two rounds, a scan a second; yours come from LiDAR and SLAM
    const Eigen::AngleAxisd turn(i * 0.14, Eigen::Vector3d::UnitZ());
    const scanloc::Pose T_map_scan = turn * Eigen::Translation3d(0.0, -25.0, 2.0);
    scanloc::PointCloud scan;  // x forward, y left, z up [m]
    for (int p = 0; p < 120 * 40; ++p) {
      const Eigen::Vector3d point(posts(0, p / 40), posts(1, p / 40), p % 40 * 0.1);
      const Eigen::Vector3f seen = (T_map_scan.inverse() * point).cast<float>();
      scan.push_back({seen.x(), seen.y(), seen.z()});
    }
    const auto said = detector->Query(scan, i * 1'000'000'000LL);  // nanoseconds
    if (!said.ok() || !detector->Add(scan, i * 1'000'000'000LL, T_map_scan).ok()) return 1;
    if (said->loop) std::printf("scan %d is at place %d\n", i, said->loop->place);
  }
}

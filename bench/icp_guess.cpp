// The paper's "Metric Localization Evaluation": PCL's ICP and GICP from where A-PC and A-CC put a
// query, with the heading or lateral offset that they tell and without. Of each query whose best
// candidate is a place within 8 m.
//   icp_guess MAP_DRIVE QUERY_DRIVE OUT_DIR [SENSOR_HEIGHT_M [K]]
// A drive is a folder with scans and poses.txt, or FOLDER:FROM:TO:STEP for some of them. Writes
// runs.csv and figures as SVG to OUT_DIR, and a Markdown table to stdout.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <numbers>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/scan/voxel_filter.hpp"
#include "scanloc/eval/quantile.hpp"
#include "scanloc/report/chart.hpp"
#include "support/drive_part.hpp"
#include "support/pcl_refine.hpp"

namespace scanloc::bench {
namespace {

constexpr double kWithin_m = 8.0;

/// One registration.
struct Run {
  std::string scan, method, refiner;
  bool with_guess = false;
  double distance = 0.0;                        ///< of the descriptors, D
  double true_offset = 0.0, told_offset = 0.0;  ///< yaw [deg] of A-PC, lateral [m] of A-CC
  Refined refined;
  PoseDifference off;

  [[nodiscard]] bool is_right() const { return !MissOf(off).any(); }
};

struct Drive {
  std::vector<dataset::Frame> frames;
  std::vector<PointCloud> scans;  ///< thinned as the map's
};

Drive ReadDrive(const std::string& text) {
  Drive drive{.frames = Frames(text), .scans = {}};
  VoxelFilter filter(Params().voxel_size_m);
  for (const dataset::Frame& frame : drive.frames) {
    drive.scans.push_back(filter.Apply(Get(dataset::ReadScan(frame.file())).points));
  }
  return drive;
}

std::shared_ptr<const Localizer> MapOf(const Drive& drive, double sensor_height_m) {
  Params params;
  params.sensor_height_m = sensor_height_m;
  params.structure.enabled = false;
  Map map = MakeEmptyMap(params);
  map.sessions = {"only"};
  Describer describer = Get(Describer::Create(params));
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    map.places.push_back({drive.frames[i].T_map_sensor, 0, 0});
    map.AppendDescriptor(static_cast<std::int32_t>(i), describer.DescribePlace(drive.scans[i]));
  }
  return Get(Localizer::Create(std::make_shared<const Map>(std::move(map))));
}

/// Heading in degrees, from -90 on so that neither along nor against is cut, or lateral offset, of
/// one pose in the frame of another.
double OffsetOf(const Pose& T_place_query, const Method& method) {
  if (method.kind == DescriptorKind::kCart) return T_place_query.translation().y();
  const double yaw_deg =
      std::atan2(T_place_query(1, 0), T_place_query(0, 0)) * 180.0 / std::numbers::pi;
  return yaw_deg < -90.0 ? yaw_deg + 360.0 : yaw_deg;
}

/// All registrations of one query with the best candidate of one method.
void RunQuery(const Localizer& localizer, const Drive& places, const Drive& queries,
              std::size_t number, const std::string& method_name, int k, std::vector<Run>* runs) {
  const PointCloud& scan = queries.scans[number];
  const Pose& T_map_true = queries.frames[number].T_map_sensor;
  const Method method = Get(ParseMethod(method_name));
  Describer describer = Get(Describer::Create(localizer.map().params));
  const Answer answer = Get(localizer.Localize(
      describer.Describe(scan), {.method = method, .num_candidates = k, .max_answers = 1}));
  if (answer.candidates.empty()) return;
  const Candidate& best = answer.candidates.front();
  const Pose T_place_true = best.T_map_place.inverse() * T_map_true;
  if (T_place_true.translation().head<2>().norm() > kWithin_m) return;
  const Pose T_place_told = best.T_map_place.inverse() * best.T_map_query;
  const PointCloud& target = places.scans[static_cast<std::size_t>(best.place)];
  for (const Refiner refiner : {Refiner::kIcp, Refiner::kGicp}) {
    for (const bool with_guess : {false, true}) {
      Run run{.scan = queries.frames[number].name,
              .method = method_name,
              .refiner = refiner == Refiner::kIcp ? "ICP" : "GICP",
              .with_guess = with_guess,
              .distance = best.distance,
              .true_offset = OffsetOf(T_place_true, method),
              .told_offset = OffsetOf(T_place_told, method)};
      run.refined = Refine(refiner, scan, target, with_guess ? T_place_told : Pose::Identity(), {});
      run.off = DifferenceOf(best.T_map_place * run.refined.T_target_source, T_map_true);
      runs->push_back(std::move(run));
    }
  }
}

/// By less than half a turn.
double Apart(const Run& run) {
  const double apart = run.told_offset - run.true_offset;
  return run.method == "a-pc" ? std::remainder(apart, 360.0) : apart;
}

void WriteFile(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) Fail(absl::StrCat("cannot write ", path.string()));
}

std::string Csv(const std::vector<Run>& runs) {
  std::string csv =
      "scan,method,refiner,with_guess,distance,true_offset,told_offset,converged,iterations,"
      "rmse_m,plane_m,height_m,heading_deg,right\n";
  for (const Run& run : runs) {
    absl::StrAppendFormat(&csv, "%s,%s,%s,%d,%.6f,%.4f,%.4f,%d,%d,%.4f,%.4f,%.4f,%.4f,%d\n",
                          run.scan, run.method, run.refiner, run.with_guess, run.distance,
                          run.true_offset, run.told_offset, run.refined.has_converged,
                          run.refined.num_iterations, run.refined.rmse_m, run.off.plane_m,
                          run.off.height_m, run.off.heading_deg, run.is_right());
  }
  return csv;
}

void PrintTable(const std::vector<Run>& runs, const std::string& method) {
  for (const char* refiner : {"ICP", "GICP"}) {
    for (const bool with_guess : {false, true}) {
      std::vector<double> iterations, plane_m, heading_deg;
      std::size_t num_right = 0;
      for (const Run& run : runs) {
        if (run.method != method || run.refiner != refiner || run.with_guess != with_guess)
          continue;
        iterations.push_back(run.refined.num_iterations);
        plane_m.push_back(run.off.plane_m);
        heading_deg.push_back(run.off.heading_deg);
        num_right += run.is_right() ? 1 : 0;
      }
      if (iterations.empty()) continue;
      const auto num = static_cast<double>(iterations.size());
      std::cout << absl::StrFormat(
          "| %s | %s | %s | %d | %.3f | %.1f | %.2f | %.2f | %.2f | %.2f |\n", method, refiner,
          with_guess ? "with" : "without", iterations.size(), static_cast<double>(num_right) / num,
          *eval::Mean(iterations), *eval::Quantile(plane_m, 0.5), *eval::Mean(plane_m),
          *eval::Quantile(heading_deg, 0.5), *eval::Mean(heading_deg));
    }
  }
}

/// What is told and what is true, match by match; and how far apart, below.
report::LineChart OffsetChart(const std::vector<Run>& runs, const std::string& method) {
  const bool is_yaw = method == "a-pc";
  report::ChartSeries truth{.name = "true", .color = report::colors::kVermilion};
  report::ChartSeries told{
      .name = method, .style = report::ChartSeries::Style::kMarks, .color = report::colors::kBlue};
  report::ChartSeries apart{.name = "error",
                            .style = report::ChartSeries::Style::kMarks,
                            .color = report::colors::kGreen,
                            .mark = report::Mark::kCross};
  double lowest = -1.0, highest = 1.0;
  for (const Run& run : runs) {
    if (run.method != method || run.refiner != "ICP" || run.with_guess) continue;
    const auto x = static_cast<double>(truth.points.size());
    truth.points.emplace_back(x, run.true_offset, 0.0);
    told.points.emplace_back(x, run.told_offset, 0.0);
    apart.points.emplace_back(x, Apart(run), 0.0);
    for (const double y : {run.true_offset, run.told_offset, Apart(run)}) {
      lowest = std::min(lowest, y);
      highest = std::max(highest, y);
    }
  }
  const auto last = static_cast<double>(std::max<std::size_t>(truth.points.size(), 2) - 1);
  return {.x = {"match", 0.0, last},
          .y = {is_yaw ? "relative yaw [°]" : "relative lateral position [m]", lowest, highest},
          .series = {truth, told, apart}};
}

/// Error after ICP over the descriptors' distance.
report::LineChart ErrorChart(const std::vector<Run>& runs, const std::string& method) {
  report::LineChart chart{.x = {"descriptor distance", 0.0, 1.0},
                          .y = {"error of the pose [m]", 0.0, 1.0}};
  for (const bool with_guess : {false, true}) {
    report::ChartSeries series{
        .name = with_guess ? "ICP from the guess" : "ICP without",
        .style = report::ChartSeries::Style::kMarks,
        .color = with_guess ? report::colors::kBlue : report::colors::kVermilion,
        .mark = with_guess ? report::Mark::kDisc : report::Mark::kCross};
    for (const Run& run : runs) {
      if (run.method != method || run.refiner != "ICP" || run.with_guess != with_guess) continue;
      series.points.emplace_back(run.distance, run.off.plane_m, 0.0);
      chart.y.high = std::max(chart.y.high, run.off.plane_m);
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

void RunAll(const std::string& map_drive, const std::string& query_drive, const std::string& out,
            double sensor_height_m, int k) {
  const Drive places = ReadDrive(map_drive);
  const Drive queries = ReadDrive(query_drive);
  const std::shared_ptr<const Localizer> localizer = MapOf(places, sensor_height_m);
  std::vector<Run> runs;
  std::error_code error;
  std::filesystem::create_directories(out, error);
  std::cout << "| place by | refiner | guess | matches | right | iterations | median m | mean m | "
               "median ° | mean ° |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const std::string method : {"a-pc", "a-cc"}) {
    for (std::size_t i = 0; i < queries.frames.size(); ++i) {
      RunQuery(*localizer, places, queries, i, method, k, &runs);
    }
    PrintTable(runs, method);
    const std::filesystem::path folder(out);
    WriteFile(folder / (method + "-offset.svg"), report::Draw(OffsetChart(runs, method)));
    WriteFile(folder / (method + "-error.svg"), report::Draw(ErrorChart(runs, method)));
  }
  WriteFile(std::filesystem::path(out) / "runs.csv", Csv(runs));
}

}  // namespace
}  // namespace scanloc::bench

int main(int argc, char** argv) {
  double sensor_height_m = scanloc::Params().sensor_height_m;
  int k = 10;
  if (argc < 4 || argc > 6 || (argc > 4 && !absl::SimpleAtod(argv[4], &sensor_height_m)) ||
      (argc > 5 && !absl::SimpleAtoi(argv[5], &k))) {
    scanloc::bench::Fail("icp_guess MAP_DRIVE QUERY_DRIVE OUT_DIR [SENSOR_HEIGHT_M [K]]");
  }
  scanloc::bench::RunAll(argv[1], argv[2], argv[3], sensor_height_m, k);
}

#include "scanloc/eval/seg_match.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "scanloc/core/scan/voxel_filter.hpp"
#include "shared.hpp"

namespace scanloc::eval {
namespace {

using Cell = std::array<int, 3>;

int CellOf(float value, double size) { return static_cast<int>(std::floor(value / size)); }

/// The voxels within reach that stand on the ground, which is the lowest of the surrounding voxels.
std::vector<Eigen::Vector3d> AboveGround(const PointCloud& voxels) {
  constexpr double kColumn_m = 2.0;
  std::map<std::array<int, 2>, float> lowest;
  const auto column_of = [](const Point& p) {
    return std::array{CellOf(p.x, kColumn_m), CellOf(p.y, kColumn_m)};
  };
  for (const Point& p : voxels) {
    const auto [at, is_new] = lowest.emplace(column_of(p), p.z);
    if (!is_new) at->second = std::min(at->second, p.z);
  }
  std::vector<Eigen::Vector3d> standing;
  for (const Point& p : voxels) {
    if (std::hypot(p.x, p.y) > SegMatch::kReach_m) continue;
    const std::array<int, 2> column = column_of(p);
    float ground_m = p.z;
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        const auto found = lowest.find({column[0] + dx, column[1] + dy});
        if (found != lowest.end()) ground_m = std::min(ground_m, found->second);
      }
    }
    if (p.z - ground_m > SegMatch::kGround_m) standing.emplace_back(p.x, p.y, p.z);
  }
  return standing;
}

/// Points in cells that touch, be it at a corner, are of one segment.
std::vector<std::vector<Eigen::Vector3d>> Segments(const std::vector<Eigen::Vector3d>& points) {
  std::map<Cell, std::vector<std::size_t>> cells;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Cell cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cell[axis] = CellOf(static_cast<float>(points[i][static_cast<Eigen::Index>(axis)]),
                          SegMatch::kVoxelSize_m);
    }
    cells[cell].push_back(i);
  }
  std::vector<std::vector<Eigen::Vector3d>> segments;
  while (!cells.empty()) {
    std::vector<Cell> open = {cells.begin()->first};
    std::vector<Eigen::Vector3d> segment;
    while (!open.empty()) {
      const Cell cell = open.back();
      open.pop_back();
      const auto here = cells.find(cell);
      if (here == cells.end()) continue;
      for (const std::size_t i : here->second) segment.push_back(points[i]);
      cells.erase(here);
      for (int n = 0; n < 27; ++n) {
        open.push_back({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
      }
    }
    const auto size = static_cast<int>(segment.size());
    if (size >= SegMatch::kLeastVoxels && size <= SegMatch::kMostVoxels) {
      segments.push_back(std::move(segment));
    }
  }
  return segments;
}

Eigen::Matrix<float, 1, SegMatch::kRowLength> RowOf(const std::vector<Eigen::Vector3d>& segment) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(segment.size()));
  for (std::size_t i = 0; i < segment.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = segment[i];
  }
  const Eigen::Vector3d centroid = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - centroid;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(centred * centred.transpose(),
                                                              Eigen::EigenvaluesOnly);
  const Eigen::Vector3d rising = solver.eigenvalues().cwiseMax(1e-9);
  const Eigen::Vector3d e = rising.reverse() / rising.sum();
  Eigen::Matrix<double, 1, SegMatch::kRowLength> row;
  row << (e(0) - e(1)) / e(0), (e(1) - e(2)) / e(0), e(2) / e(0), std::cbrt(e.prod()),
      (e(0) - e(2)) / e(0), -(e.array() * e.array().log()).sum(), e(2), centroid.transpose();
  return row.cast<float>();
}

}  // namespace

Eigen::VectorXf SegMatch::Describe(PointView scan) const {
  VoxelFilter filter(kVoxelSize_m);
  const auto segments = Segments(AboveGround(filter.Apply(scan)));
  Rows rows(static_cast<Eigen::Index>(segments.size()), kRowLength);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = RowOf(segments[i]);
  }
  return Eigen::Map<const Eigen::VectorXf>(rows.data(), rows.size());
}

void SegMatch::Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) {
  map_ = &map;
  Eigen::Index num_segments = 0;
  for (const Eigen::VectorXf& vector : vectors) num_segments += vector.size() / kRowLength;
  segments_.resize(num_segments, kRowLength);
  place_of_.clear();
  for (std::size_t place = 0; place < vectors.size(); ++place) {
    const Eigen::VectorXf& vector = vectors[place];
    const Eigen::Index num = vector.size() / kRowLength;
    segments_.middleRows(static_cast<Eigen::Index>(place_of_.size()), num) =
        Eigen::Map<const Rows>(vector.data(), num, kRowLength);
    place_of_.insert(place_of_.end(), static_cast<std::size_t>(num),
                     static_cast<std::int32_t>(place));
  }
  scale_.setOnes();
  if (num_segments < 2) return;
  auto features = segments_.leftCols<kNumFeatures>();
  const Eigen::Matrix<float, 1, kNumFeatures> mean = features.colwise().mean();
  const auto spread =
      ((features.rowwise() - mean).colwise().squaredNorm() / static_cast<float>(num_segments))
          .cwiseSqrt();
  scale_ = spread.cwiseMax(1e-6F).cwiseInverse();
  features.array().rowwise() *= scale_.array();
}

std::vector<std::vector<SegMatch::Pair>> SegMatch::FindPairs(
    const Rows& query, const std::vector<bool>* excluded) const {
  std::vector<std::vector<Pair>> of_place(map_->places.size());
  std::vector<Pair> pairs;
  for (Eigen::Index i = 0; i < query.rows(); ++i) {
    pairs.clear();
    for (Eigen::Index j = 0; j < segments_.rows(); ++j) {
      const auto place = static_cast<std::size_t>(place_of_[static_cast<std::size_t>(j)]);
      if (excluded != nullptr && (*excluded)[place]) continue;
      const float squared =
          (segments_.row(j).head<kNumFeatures>() - query.row(i).head<kNumFeatures>()).squaredNorm();
      pairs.push_back({i, j, squared});
    }
    const std::size_t num = std::min<std::size_t>(kNumNeighbors, pairs.size());
    std::partial_sort(pairs.begin(), pairs.begin() + static_cast<std::ptrdiff_t>(num), pairs.end(),
                      [](const Pair& a, const Pair& b) {
                        return std::pair(a.distance, a.of_map) < std::pair(b.distance, b.of_map);
                      });
    pairs.resize(num);
    for (const Pair& pair : pairs) {
      of_place[static_cast<std::size_t>(place_of_[static_cast<std::size_t>(pair.of_map)])]
          .push_back(pair);
    }
  }
  return of_place;
}

std::vector<SegMatch::Pair> SegMatch::LargestConsistent(const Rows& query,
                                                        const std::vector<Pair>& pairs) const {
  const auto agree = [&](const Pair& a, const Pair& b) {
    if (a.of_query == b.of_query || a.of_map == b.of_map) return false;
    const auto apart = [](const Rows& rows, Eigen::Index i, Eigen::Index j) {
      return (rows.row(i).tail<3>() - rows.row(j).tail<3>()).norm();
    };
    return std::abs(apart(query, a.of_query, b.of_query) - apart(segments_, a.of_map, b.of_map)) <=
           kResolution_m;
  };
  std::vector<Pair> largest, group;
  for (const Pair& seed : pairs) {
    group = {seed};
    for (const Pair& pair : pairs) {
      if (std::ranges::all_of(group, [&](const Pair& member) { return agree(member, pair); })) {
        group.push_back(pair);
      }
    }
    if (group.size() > largest.size()) largest = group;
  }
  return largest;
}

Answer SegMatch::Recognize(const BaselineQuery& query) const {
  Answer answer;
  const Stopwatch description(query.now_ns);
  const Eigen::VectorXf vector = Describe(query.scan);
  Rows rows = Eigen::Map<const Rows>(vector.data(), vector.size() / kRowLength, kRowLength);
  rows.leftCols<kNumFeatures>().array().rowwise() *= scale_.array();
  answer.times.describe_ns = description.Elapsed_ns();

  const Stopwatch retrieval(query.now_ns);
  const std::vector<std::vector<Pair>> of_place = FindPairs(rows, query.excluded);
  answer.times.retrieve_ns = retrieval.Elapsed_ns();

  const Stopwatch matching(query.now_ns);
  std::map<std::int32_t, double> distances;
  for (std::size_t place = 0; place < of_place.size(); ++place) {
    const std::vector<Pair> group = LargestConsistent(rows, of_place[place]);
    if (group.size() < kLeastConsistent) continue;
    double sum = 0.0;
    for (const Pair& pair : group) sum += pair.distance;
    // In (0, 1): more segments are nearer, and among equally many those more alike.
    const auto num = static_cast<double>(group.size());
    distances[static_cast<std::int32_t>(place)] = 1.0 / (num + 1.0 / (1.0 + sum / num));
  }
  AppendNearest(*map_, distances, query.num_answers, &answer);
  answer.times.match_ns = matching.Elapsed_ns();
  return answer;
}

}  // namespace scanloc::eval

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

/// Slow and obvious references for eval: plain numbers, every threshold, bin and place looked at
/// anew.
namespace scanloc::brute_force {

struct PlanePose {
  double x_m = 0.0, y_m = 0.0, yaw_rad = 0.0;
};

/// A small drive over a map, and what a method said to it.
struct SmallDrive {
  struct MapPlace {
    PlanePose pose;
    std::int64_t stamp_ns = 0;
  };
  struct Told {
    int place = 0;
    PlanePose pose;
    double confidence = 0.0;
  };
  struct Query {
    std::optional<PlanePose> truth;  ///< none: taken elsewhere
    std::optional<std::int64_t> sees_until_ns;
    std::vector<Told> told;  ///< best first
  };
  std::vector<MapPlace> places;
  std::vector<Query> queries;
  double within_m = 8.0;
};

/// The same seed gives the same drive; among them such without places, queries, revisits, matches
/// or right ones, with all scores equal, and growing maps.
SmallDrive RandomDrive(std::uint64_t seed);

struct Figures {
  struct Nearest {
    double distance_m = 0.0, turn_deg = 0.0;
  };
  std::vector<std::optional<Nearest>> nearest;  ///< place that the query sees
  std::vector<bool> is_revisit, is_right;
  int num_revisits = 0, num_right_beyond = 0;

  struct Point {
    double threshold = 0.0, precision = 0.0, recall = 0.0, f1 = 0.0;
  };
  std::vector<Point> points;  ///< one a distinct score, highest first
  double area = 0.0, f1_max = 0.0, recall_at_full_precision = 0.0, extended_precision = 0.0;
  std::optional<double> best_threshold;  ///< none where f1_max is 0
  std::map<int, std::optional<double>> recall_at;
  double calibration_error = 0.0;  ///< in ten bins, of the pose

  std::map<std::pair<int, int>, int> histogram;  ///< of revisits
  using DrCurve = std::vector<std::optional<double>>;
  DrCurve dr;                         ///< at each point
  std::array<DrCurve, 4> dr_of_kind;  ///< likewise
  std::array<int, 4> num_of_kind{};   ///< revisits: easy, lateral, rotational, both
  std::vector<double> position_errors_m, lateral_errors_m, yaw_errors_deg;  ///< of right matches
};
Figures Evaluate(const SmallDrive& drive);

/// Linear through (i / (n - 1), i-th smallest value).
double QuantileOf(std::vector<double> values, double share);

}  // namespace scanloc::brute_force

#include "support/brute_force_eval.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>

namespace scanloc::brute_force {
namespace {

constexpr double kPi = 3.14159265358979323846;

double Distance_m(const PlanePose& a, const PlanePose& b) {
  return std::sqrt((a.x_m - b.x_m) * (a.x_m - b.x_m) + (a.y_m - b.y_m) * (a.y_m - b.y_m));
}

double Turn_deg(const PlanePose& a, const PlanePose& b) {
  double turn_rad = std::fmod(std::fabs(a.yaw_rad - b.yaw_rad), 2.0 * kPi);
  if (turn_rad > kPi) turn_rad = 2.0 * kPi - turn_rad;
  return turn_rad * 180.0 / kPi;
}

int KindNumber(const Figures::Nearest& nearest) {
  return (nearest.distance_m >= 2.0 ? 1 : 0) + (nearest.turn_deg >= 90.0 ? 2 : 0);
}

std::pair<int, int> BinOf(const Figures::Nearest& nearest) {
  return {static_cast<int>(std::floor(nearest.distance_m / 0.5)),
          static_cast<int>(std::floor(nearest.turn_deg / 10.0))};
}

void FindTruth(const SmallDrive& drive, Figures* figures) {
  for (const SmallDrive::Query& query : drive.queries) {
    std::optional<Figures::Nearest> nearest;
    for (const SmallDrive::MapPlace& place : drive.places) {
      if (!query.truth) continue;
      if (query.sees_until_ns && place.stamp_ns >= *query.sees_until_ns) continue;
      const Figures::Nearest here{Distance_m(place.pose, *query.truth),
                                  Turn_deg(place.pose, *query.truth)};
      if (!nearest || here.distance_m < nearest->distance_m) nearest = here;
    }
    const bool is_revisit = nearest && nearest->distance_m <= drive.within_m;
    figures->nearest.push_back(nearest);
    figures->is_revisit.push_back(is_revisit);
    figures->num_revisits += is_revisit ? 1 : 0;
    if (is_revisit) ++figures->histogram[BinOf(*nearest)];
    if (is_revisit) ++figures->num_of_kind[static_cast<std::size_t>(KindNumber(*nearest))];
  }
}

bool IsPlaceRight(const SmallDrive& drive, const SmallDrive::Query& query, std::size_t rank) {
  if (!query.truth || rank >= query.told.size()) return false;
  const auto place = static_cast<std::size_t>(query.told[rank].place);
  return Distance_m(drive.places[place].pose, *query.truth) <= drive.within_m;
}

bool IsPoseRight(const SmallDrive::Query& query) {
  return query.truth && !query.told.empty() &&
         Distance_m(query.told[0].pose, *query.truth) <= 1.0 &&
         Turn_deg(query.told[0].pose, *query.truth) <= 10.0;
}

void JudgeMatches(const SmallDrive& drive, Figures* figures) {
  for (std::size_t i = 0; i < drive.queries.size(); ++i) {
    const SmallDrive::Query& query = drive.queries[i];
    const bool is_right = IsPlaceRight(drive, query, 0);
    figures->is_right.push_back(is_right);
    if (IsPoseRight(query) && !figures->is_revisit[i]) ++figures->num_right_beyond;
    if (!is_right) continue;
    const PlanePose& found = query.told[0].pose;
    figures->position_errors_m.push_back(Distance_m(found, *query.truth));
    // Across the heading: what is left of the offset turned into the vehicle's frame.
    const double x_m = found.x_m - query.truth->x_m;
    const double y_m = found.y_m - query.truth->y_m;
    figures->lateral_errors_m.push_back(
        std::fabs(-std::sin(query.truth->yaw_rad) * x_m + std::cos(query.truth->yaw_rad) * y_m));
    figures->yaw_errors_deg.push_back(Turn_deg(found, *query.truth));
  }
  for (const int n : {1, 5, 10}) {
    int num_found = 0;
    for (std::size_t i = 0; i < drive.queries.size(); ++i) {
      bool is_found = false;
      for (std::size_t rank = 0; rank < static_cast<std::size_t>(n); ++rank) {
        if (figures->is_revisit[i] && IsPlaceRight(drive, drive.queries[i], rank)) is_found = true;
      }
      num_found += is_found ? 1 : 0;
    }
    if (figures->num_revisits > 0) {
      figures->recall_at[n] = static_cast<double>(num_found) / figures->num_revisits;
    } else {
      figures->recall_at[n] = std::nullopt;
    }
  }
}

bool IsAccepted(const SmallDrive::Query& query, double threshold) {
  return !query.told.empty() && query.told[0].confidence >= threshold;
}

void DrawCurve(const SmallDrive& drive, Figures* figures) {
  std::set<double, std::greater<>> thresholds;
  for (const SmallDrive::Query& query : drive.queries) {
    if (!query.told.empty()) thresholds.insert(query.told[0].confidence);
  }
  for (const double threshold : thresholds) {
    double num_accepted = 0.0, num_right = 0.0;
    for (std::size_t i = 0; i < drive.queries.size(); ++i) {
      if (!IsAccepted(drive.queries[i], threshold)) continue;
      num_accepted += 1.0;
      if (figures->is_right[i]) num_right += 1.0;
    }
    Figures::Point point{.threshold = threshold, .precision = num_right / num_accepted};
    if (figures->num_revisits > 0) point.recall = num_right / figures->num_revisits;
    if (num_right > 0.0) point.f1 = 2.0 / (1.0 / point.precision + 1.0 / point.recall);
    figures->points.push_back(point);
  }
}

void SumUpCurve(Figures* figures) {
  double least_recall = 2.0, its_precision = 0.0;
  for (std::size_t i = 0; i < figures->points.size(); ++i) {
    const Figures::Point& point = figures->points[i];
    figures->f1_max = std::max(figures->f1_max, point.f1);
    if (point.precision == 1.0) {
      figures->recall_at_full_precision = std::max(figures->recall_at_full_precision, point.recall);
    }
    if (point.recall > 0.0 && point.recall <= least_recall) {
      its_precision =
          point.recall < least_recall ? point.precision : std::max(its_precision, point.precision);
      least_recall = point.recall;
    }
    const Figures::Point before =
        i > 0 ? figures->points[i - 1] : Figures::Point{.precision = point.precision};
    figures->area += (point.recall - before.recall) * (point.precision + before.precision) / 2.0;
  }
  if (least_recall <= 1.0) {
    figures->extended_precision = (its_precision + figures->recall_at_full_precision) / 2.0;
  }
  for (const Figures::Point& point : figures->points) {
    if (figures->f1_max > 0.0 && !figures->best_threshold && point.f1 >= figures->f1_max - 1e-12) {
      figures->best_threshold = point.threshold;
    }
  }
}

/// kind -1: all.
std::optional<double> DivergenceAt(const SmallDrive& drive, const Figures& figures,
                                   double threshold, int kind) {
  std::map<std::pair<int, int>, double> all, found;
  double num_all = 0.0, num_found = 0.0;
  for (std::size_t i = 0; i < drive.queries.size(); ++i) {
    if (!figures.is_revisit[i]) continue;
    if (kind >= 0 && KindNumber(*figures.nearest[i]) != kind) continue;
    const auto bin = BinOf(*figures.nearest[i]);
    all[bin] += 1.0;
    num_all += 1.0;
    if (!figures.is_right[i] || !IsAccepted(drive.queries[i], threshold)) continue;
    found[bin] += 1.0;
    num_found += 1.0;
  }
  if (num_found == 0.0) return std::nullopt;
  double divergence = 0.0;
  for (const auto& [bin, count] : found) {
    divergence += count / num_found * (std::log(count / num_found) - std::log(all[bin] / num_all));
  }
  return divergence;
}

void CalibrateConfidence(const SmallDrive& drive, Figures* figures) {
  double num_matched = 0.0;
  for (const SmallDrive::Query& query : drive.queries) num_matched += query.told.empty() ? 0 : 1;
  for (int bin = 0; bin < 10; ++bin) {
    double count = 0.0, sum = 0.0, num_right = 0.0;
    for (const SmallDrive::Query& query : drive.queries) {
      if (query.told.empty()) continue;
      const double confidence = query.told[0].confidence;
      const bool is_last = bin == 9 && confidence == 1.0;
      if (!is_last && (confidence < bin / 10.0 || confidence >= (bin + 1) / 10.0)) continue;
      count += 1.0;
      sum += confidence;
      num_right += IsPoseRight(query) ? 1.0 : 0.0;
    }
    if (count == 0.0) continue;
    figures->calibration_error += count / num_matched * std::fabs(sum / count - num_right / count);
  }
}

}  // namespace

SmallDrive RandomDrive(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) /
                     static_cast<double>(std::uint64_t{1} << 53);
  };
  const auto pose = [&](double extent_m) {
    return PlanePose{uniform(-extent_m, extent_m), uniform(-extent_m, extent_m),
                     uniform(-kPi, kPi)};
  };
  SmallDrive drive;
  drive.within_m = std::array{8.0, 4.0, 2.0}[random() % 3];
  const bool grows = random() % 3 == 0;
  const std::uint64_t num_scores = 1 + random() % 12;  // few: many ties
  const double extent_m = uniform(5.0, 40.0);
  const std::uint64_t share_right = random() % 4;
  const auto num_places = static_cast<std::size_t>(random() % 12);
  for (std::size_t i = 0; i < num_places; ++i) {
    drive.places.push_back({pose(extent_m), static_cast<std::int64_t>(i) * 10});
  }
  const auto num_queries = static_cast<std::size_t>(random() % 30);
  for (std::size_t i = 0; i < num_queries; ++i) {
    SmallDrive::Query query;
    if (random() % 5 > 0) query.truth = pose(extent_m);
    if (grows) query.sees_until_ns = static_cast<std::int64_t>(random() % 130) - 5;
    std::vector<int> visible;
    for (std::size_t p = 0; p < num_places; ++p) {
      if (!query.sees_until_ns || drive.places[p].stamp_ns < *query.sees_until_ns) {
        visible.push_back(static_cast<int>(p));
      }
    }
    std::shuffle(visible.begin(), visible.end(), random);
    if (random() % 4 < share_right && query.truth) {
      std::sort(visible.begin(), visible.end(), [&](int a, int b) {
        return Distance_m(drive.places[static_cast<std::size_t>(a)].pose, *query.truth) <
               Distance_m(drive.places[static_cast<std::size_t>(b)].pose, *query.truth);
      });
    }
    visible.resize(std::min<std::size_t>(visible.size(), random() % 11));
    for (const int place : visible) {
      SmallDrive::Told told{.place = place};
      told.pose = query.truth && random() % 2 == 0 ? *query.truth : pose(extent_m);
      told.pose.x_m += uniform(-1.0, 1.0);
      told.confidence = static_cast<double>(random() % num_scores) / 16.0;
      query.told.push_back(told);
    }
    drive.queries.push_back(query);
  }
  return drive;
}

Figures Evaluate(const SmallDrive& drive) {
  Figures figures;
  FindTruth(drive, &figures);
  JudgeMatches(drive, &figures);
  DrawCurve(drive, &figures);
  SumUpCurve(&figures);
  CalibrateConfidence(drive, &figures);
  for (const Figures::Point& point : figures.points) {
    figures.dr.push_back(DivergenceAt(drive, figures, point.threshold, -1));
    for (int kind = 0; kind < 4; ++kind) {
      figures.dr_of_kind[static_cast<std::size_t>(kind)].push_back(
          DivergenceAt(drive, figures, point.threshold, kind));
    }
  }
  return figures;
}

double QuantileOf(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  if (values.size() == 1) return values[0];
  const double step = 1.0 / static_cast<double>(values.size() - 1);
  for (std::size_t i = 0; i + 1 < values.size(); ++i) {
    const double here = static_cast<double>(i) * step;
    if (share >= here && share < here + step) {
      return values[i] + (values[i + 1] - values[i]) * (share - here) / step;
    }
  }
  return values.back();
}

}  // namespace scanloc::brute_force

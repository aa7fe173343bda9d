#include "scanloc/eval/ground_truth.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace scanloc::eval {

double PlanarDistance_m(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).head<2>().norm();
}

double HeadingDifference_deg(const Pose& a, const Pose& b) {
  return std::abs(WrapAngle(Yaw(a) - Yaw(b))) * 180.0 / std::numbers::pi;
}

std::vector<bool> HiddenPlaces(std::span<const Place> places,
                               std::optional<std::int64_t> sees_until_ns) {
  std::vector<bool> hidden;
  if (!sees_until_ns) return hidden;
  hidden.reserve(places.size());
  for (const Place& place : places) hidden.push_back(place.stamp_ns >= *sees_until_ns);
  return hidden;
}

std::optional<RevisitVariance> NearestPlace(std::span<const Place> places,
                                            const std::vector<bool>& hidden,
                                            const Pose& T_map_true) {
  const Place* nearest = nullptr;
  RevisitVariance variance;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!hidden.empty() && hidden[i]) continue;
    const double distance_m = PlanarDistance_m(places[i].T_map_place, T_map_true);
    if (nearest != nullptr && distance_m >= variance.translation_m) continue;
    nearest = &places[i];
    variance.translation_m = distance_m;
  }
  if (nearest == nullptr) return std::nullopt;
  variance.rotation_deg = HeadingDifference_deg(nearest->T_map_place, T_map_true);
  return variance;
}

bool IsRevisit(const std::optional<RevisitVariance>& nearest, double within_m) {
  return nearest && nearest->translation_m <= within_m;
}

}  // namespace scanloc::eval

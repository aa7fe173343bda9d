#include "scanloc/core/prior.hpp"

#include <cmath>

#include "absl/strings/str_format.h"
#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

bool IsCoordinate(double value) { return std::abs(value) <= limits::kMaxTranslation_m; }
bool IsRadius(double value) { return value > 0.0 && IsCoordinate(value); }  // NaN is none

}  // namespace

absl::Status Validate(const Prior& prior) {
  if (prior.disc) {
    const Prior::Disc& disc = *prior.disc;
    if (!IsCoordinate(disc.x_m) || !IsCoordinate(disc.y_m) || !IsRadius(disc.radius_m)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "the prior is within %g m of (%g, %g) m; the radius must be above 0, and all of them "
          "within ±%g m",
          disc.radius_m, disc.x_m, disc.y_m, limits::kMaxTranslation_m));
    }
  }
  if (prior.on_earth) {
    const Prior::GeoDisc& disc = *prior.on_earth;
    if (!(std::abs(disc.latitude_deg) <= 90.0) || !(std::abs(disc.longitude_deg) <= 180.0) ||
        !IsRadius(disc.radius_m)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "the prior is within %g m of latitude %g, longitude %g; the radius must be above 0 and "
          "at most %g m, and these within ±90 and ±180 degrees",
          disc.radius_m, disc.latitude_deg, disc.longitude_deg, limits::kMaxTranslation_m));
    }
    if (prior.disc) {
      return absl::InvalidArgumentError(
          "the prior has a disc on the map and one on earth; give one");
    }
  }
  if (prior.heights) {
    const Prior::Heights& heights = *prior.heights;
    if (!IsCoordinate(heights.min_m) || !IsCoordinate(heights.max_m) ||
        heights.min_m >= heights.max_m) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "the prior's heights go from %g to %g m; the first must be less than the second, both "
          "within ±%g m",
          heights.min_m, heights.max_m, limits::kMaxTranslation_m));
    }
  }
  if (prior.sessions.size() > limits::kMaxPriorSessions) {
    return absl::InvalidArgumentError(
        absl::StrFormat("the prior names %d sessions; at most %d are allowed",
                        prior.sessions.size(), limits::kMaxPriorSessions));
  }
  return absl::OkStatus();
}

}  // namespace scanloc

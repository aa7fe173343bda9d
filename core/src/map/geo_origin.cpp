#include "scanloc/core/map/geo_origin.hpp"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

constexpr double kMaxAltitude_m = 1.0e5;

absl::Status CheckWithin(const char* what, double value, double limit) {
  if (std::abs(value) <= limit) return absl::OkStatus();  // not of NaN
  return absl::InvalidArgumentError(absl::StrCat("geo origin: ", what, " is ", value,
                                                 "; it must be in [-", limit, ", ", limit, "]"));
}

}  // namespace

absl::Status Validate(const GeoOrigin& origin) {
  absl::Status status = CheckWithin("latitude", origin.latitude_deg, 90.0);
  status.Update(CheckWithin("longitude", origin.longitude_deg, 360.0));
  status.Update(CheckWithin("altitude", origin.altitude_m, kMaxAltitude_m));
  status.Update(CheckWithin("heading", origin.heading_deg, 360.0));
  for (int axis = 0; axis < 3; ++axis) {
    status.Update(CheckWithin("anchor", origin.anchor_m[axis], limits::kMaxTranslation_m));
  }
  return status;
}

}  // namespace scanloc

#pragma once

#include <CLI/App.hpp>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "scanloc/core/map/geo_origin.hpp"

namespace scanloc::cli {

/// Where on earth a map stands, as options of the command line: told, or found from the fixes of a
/// GNSS receiver.
class GeoOptions {
 public:
  void Declare(CLI::App& app);
  [[nodiscard]] absl::Status CheckUsage() const;
  [[nodiscard]] bool given() const { return origin_.has_value() || !fixes_.empty(); }

  /// Writes it into a map that is whole, and gives lines about it for people; none where no option
  /// was given.
  [[nodiscard]] absl::StatusOr<std::string> Apply(const std::string& map) const;

 private:
  std::optional<GeoOrigin> origin_;
  std::string fixes_;
};

/// `48.137400000 11.575500000, 519.00 m above the ellipsoid, x 90.00 deg from north`.
[[nodiscard]] std::string GeoOriginAsText(const GeoOrigin& origin);

}  // namespace scanloc::cli

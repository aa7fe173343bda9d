#pragma once

#include <CLI/App.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/dataset/gnss_fixes.hpp"

namespace scanloc::cli {

/// Where on earth a map stands, as options of the command line: told, or found from the fixes of a
/// GNSS receiver.
class GeoOptions {
 public:
  void Declare(CLI::App& app);
  [[nodiscard]] absl::Status CheckUsage() const;
  [[nodiscard]] bool given() const { return origin_.has_value() || !fixes_path_.empty(); }

  /// Reads the fixes, so that a bad file is known before any work is done.
  [[nodiscard]] absl::Status Read();

  /// After Read: writes it into a map that is whole, and gives lines about it for people; none
  /// where no option was given.
  [[nodiscard]] absl::StatusOr<std::string> Apply(const std::string& map) const;

 private:
  std::optional<GeoOrigin> origin_;
  std::string fixes_path_;
  std::vector<dataset::GnssFix> fixes_;
};

/// `48.137400000 11.575500000, 519.00 m above the ellipsoid, x 90.00 deg from north`.
[[nodiscard]] std::string GeoOriginAsText(const GeoOrigin& origin);

}  // namespace scanloc::cli

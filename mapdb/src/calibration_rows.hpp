#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map_head.hpp"
#include "scanloc/core/map/map.hpp"
#include "sqlite.hpp"

namespace scanloc::mapdb {

/// What a map file holds of its calibration.
struct StoredCalibration {
  Calibration calibration;
  std::vector<ConfusablePair> confusable;
};

/// None: the map was never calibrated, or has grown since. DataLoss: a row is damaged.
[[nodiscard]] absl::StatusOr<std::optional<StoredCalibration>> ReadCalibration(
    Connection& connection, const MapHead& head);

/// Replaces what the file holds. Requires an open write transaction.
[[nodiscard]] absl::Status WriteCalibration(const StoredCalibration& calibration,
                                            const std::string& content_id, Connection& connection);

}  // namespace scanloc::mapdb

#pragma once

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/v1/localization.pb.h"
#include "scanloc/v1/map.pb.h"

/// Checks and conversions that several messages share.
namespace scanloc::proto {

/// InvalidArgument if the text is longer than max_bytes.
[[nodiscard]] absl::Status CheckLength(absl::string_view field, const std::string& text,
                                       std::size_t max_bytes);

/// InvalidArgument if the number is NaN or infinite.
[[nodiscard]] absl::Status CheckFinite(absl::string_view field, double value);

/// InvalidArgument if the number is not in [low, high].
[[nodiscard]] absl::Status CheckRange(absl::string_view field, double value, double low,
                                      double high);

/// InvalidArgument if the number is not one of an enum's, but for its first, 0, which says nothing.
[[nodiscard]] absl::Status CheckEnum(absl::string_view field, int value, int max);

/// Translations travel exactly, rotations to some 1e-15.
[[nodiscard]] absl::StatusOr<Pose> PoseFromProto(absl::string_view field, const v1::Pose& message);
[[nodiscard]] v1::Pose PoseToProto(const Pose& pose);

/// InvalidArgument if a number is NaN or infinite.
[[nodiscard]] absl::StatusOr<Box> BoxFromProto(absl::string_view field, const v1::Box& message);
[[nodiscard]] v1::Box BoxToProto(const Box& box);

/// InvalidArgument if a number is none or out of range.
[[nodiscard]] absl::StatusOr<GeoPose> GeoPoseFromProto(absl::string_view field,
                                                       const v1::GeoPose& message);
[[nodiscard]] v1::GeoPose GeoPoseToProto(const GeoPose& pose);

[[nodiscard]] absl::StatusOr<Place> PlaceFromProto(const v1::Place& message);
[[nodiscard]] v1::Place PlaceToProto(const Place& place, const GeoPose* geo);

[[nodiscard]] absl::StatusOr<Structure> StructureFromProto(const v1::Structure& message);
[[nodiscard]] v1::Structure StructureToProto(const Structure& structure);

/// Longest content id, reason and signature [bytes].
inline constexpr std::size_t kMaxContentIdBytes = 128;
inline constexpr std::size_t kMaxReasonBytes = 4096;
inline constexpr std::size_t kMaxSignatureBytes = 1024;

}  // namespace scanloc::proto

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/proto/messages.hpp"
#include "scanloc/v1/localization.pb.h"

/// The only way between the wire and core's types.
///
/// FromProto trusts nothing: whatever it returns is in range, and a message that is not gives
/// InvalidArgument that names the field. No message makes it allocate more than a small multiple of
/// the bytes that were received. Numbers travel exactly; rotations to some 1e-15.
namespace scanloc::proto {

/// A map's name as a request gives it; empty stands for the only one, or for all.
[[nodiscard]] absl::Status CheckAskedMap(const std::string& name);

/// points is overwritten; its memory is reused. Points that are not finite are let through: it is
/// the Describer that skips and counts them.
[[nodiscard]] absl::Status FromProto(const v1::ScanPoints& message, PointCloud* points);
[[nodiscard]] v1::ScanPoints ToProto(PointView points, const SensorMount& mount = {});

/// Of the sensor that saw the scan; one that sits where the base is if it is not set.
[[nodiscard]] absl::StatusOr<SensorMount> MountFromProto(const v1::ScanPoints& message);

[[nodiscard]] absl::StatusOr<ScanHeader> HeaderFromProto(const v1::LocalizeRequest& message);
void SetHeader(const ScanHeader& header, v1::LocalizeRequest* message);

/// Checks that each context has the cells that its shape asks for; whether the shape is the map's
/// is for Validate(descriptor, params) to say.
[[nodiscard]] absl::StatusOr<SignedDescriptor> FromProto(const v1::Descriptors& message);
[[nodiscard]] v1::Descriptors ToProto(const SignedDescriptor& descriptor);

/// The budget is how long a search may verify; 0: as long as it takes.
[[nodiscard]] absl::StatusOr<Query> FromProto(const v1::LocalizeOptions& message);
[[nodiscard]] absl::StatusOr<std::chrono::milliseconds> BudgetFromProto(
    const v1::LocalizeOptions& message);
[[nodiscard]] v1::LocalizeOptions ToProto(const Query& query,
                                          std::chrono::milliseconds budget = {});

[[nodiscard]] absl::StatusOr<LocalizeReply> FromProto(const v1::LocalizeResponse& message);
[[nodiscard]] v1::LocalizeResponse ToProto(const LocalizeReply& reply);

/// The bytes of a file that a server kept (scanloc/v1/capture.proto). InvalidArgument: they are
/// none.
[[nodiscard]] absl::StatusOr<CapturedQuery> ParseCapturedQuery(const std::string& bytes);

/// T_last_scan; none if it is not set.
[[nodiscard]] absl::StatusOr<std::optional<Pose>> OdometryFromProto(const v1::StreamScan& message);
void SetOdometry(const std::optional<Pose>& T_last_scan, v1::StreamScan* message);

[[nodiscard]] absl::StatusOr<TrackedReply> FromProto(const v1::TrackedAnswer& message);
[[nodiscard]] v1::TrackedAnswer ToProto(const TrackedReply& reply);

/// The parameters pass Validate(params), too.
[[nodiscard]] absl::StatusOr<Params> FromProto(const v1::Params& message);
[[nodiscard]] v1::Params ToProto(const Params& params);

[[nodiscard]] absl::StatusOr<MapInfo> FromProto(const v1::MapInfo& message);
[[nodiscard]] v1::MapInfo ToProto(const MapInfo& info);

[[nodiscard]] absl::StatusOr<std::vector<MapSummary>> FromProto(
    const v1::ListMapsResponse& message);
[[nodiscard]] v1::ListMapsResponse ToProto(const std::vector<MapSummary>& maps);

[[nodiscard]] absl::StatusOr<PlacesPage> FromProto(const v1::ListPlacesResponse& message);
[[nodiscard]] v1::ListPlacesResponse ToProto(const PlacesPage& page);

}  // namespace scanloc::proto

#include "rpc/query_describer.hpp"

#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "ops/clock.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Above this, describers of maps that are no longer served are not worth keeping.
constexpr std::size_t kMaxDescribersKept = 16;

/// Of one point on the wire: x y z.
constexpr std::size_t kPointBytes = 12;

/// Of one worker: the tables of a scan of 260,000 voxels and its points. What a larger one took is
/// given back.
constexpr std::int64_t kMaxKeptBytes = std::int64_t{32} << 20;

/// While a scan is described: a voxel a point, and tables that grow to twice of it, for the
/// contexts and for the posts.
constexpr std::size_t kBytesPerPoint = 320;

absl::Status CheckSignature(const SignedDescriptor& query, const ServedMap& map) {
  if (query.signature == map.signature) return absl::OkStatus();
  return proto::WithReason(
      v1::ERROR_REASON_PARAMS_MISMATCH,
      absl::FailedPreconditionError(absl::StrCat(
          "the descriptors were made with \"", absl::Utf8SafeCHexEscape(query.signature),
          "\" but map ", map.info.name, " has \"", map.signature,
          "\"; fetch the map's parameters again with GetMapInfo and describe the scan with "
          "them")));
}

}  // namespace

absl::StatusOr<QueryDescriber::Described> QueryDescriber::Describe(
    const v1::LocalizeRequest& request, const ServedMap& map, std::size_t max_points) {
  switch (request.query_case()) {
    case v1::LocalizeRequest::kScan:
      return DescribeScan(request.scan(), map, max_points);
    case v1::LocalizeRequest::kDescriptors: {
      ASSIGN_OR_RETURN(auto query, proto::FromProto(request.descriptors()));
      RETURN_IF_ERROR(CheckSignature(query, map));
      return Described{.descriptor = std::move(query.descriptor)};
    }
    default:
      return absl::InvalidArgumentError(
          "the request has neither scan nor descriptors; send one of them");
  }
}

absl::StatusOr<QueryDescriber::Described> QueryDescriber::DescribeScan(const v1::ScanPoints& scan,
                                                                       const ServedMap& map,
                                                                       std::size_t max_points) {
  if (const std::size_t num_points = scan.xyz_f32le().size() / kPointBytes;
      num_points > max_points) {
    return proto::WithReason(
        v1::ERROR_REASON_TOO_MANY_POINTS,
        absl::ResourceExhaustedError(
            absl::StrCat("the scan has ", num_points, " points; this server allows ", max_points)));
  }
  RETURN_IF_ERROR(proto::FromProto(scan, &points_));
  ASSIGN_OR_RETURN(auto mount, proto::MountFromProto(scan));
  ASSIGN_OR_RETURN(const auto describer, DescriberFor(map));
  Described result{.mount = std::move(mount)};
  held_bytes_ += static_cast<std::int64_t>(kBytesPerPoint * points_.size());
  const std::int64_t start_ns = NowNs();
  const std::size_t num_masked = ApplyMount(result.mount, points_);
  result.descriptor = describer->Describe(points_, &result.scan_counts.emplace());
  result.scan_counts->num_masked = num_masked;
  result.describe_ns = NowNs() - start_ns;
  KeepWhatIsUsual(map.signature);
  return result;
}

void QueryDescriber::KeepWhatIsUsual(const std::string& last_used) {
  const auto kept_bytes = [this] {
    std::size_t sum = points_.capacity() * sizeof(Point);
    for (const auto& [signature, describer] : describers_) sum += describer.held_bytes();
    return static_cast<std::int64_t>(sum);
  };
  if (kept_bytes() > kMaxKeptBytes) {
    std::erase_if(describers_, [&](const auto& entry) { return entry.first != last_used; });
  }
  if (kept_bytes() > kMaxKeptBytes) {
    points_ = PointCloud();  // = {} would keep its memory
    describers_.clear();
  }
  held_bytes_ = kept_bytes();
}

absl::StatusOr<Describer*> QueryDescriber::DescriberFor(const ServedMap& map) {
  if (const auto found = describers_.find(map.signature); found != describers_.end()) {
    return &found->second;
  }
  ASSIGN_OR_RETURN(auto describer, Describer::Create(map.info.params));
  if (describers_.size() >= kMaxDescribersKept) describers_.clear();
  return &describers_.emplace(map.signature, std::move(describer)).first->second;
}

}  // namespace scanloc::server

#include <utility>

#include "absl/strings/str_cat.h"
#include "fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc::proto {
namespace {

absl::Status Check(const v1::Candidate& message) {
  if (message.place() < 0 || message.session() < 0) {
    return absl::InvalidArgumentError(absl::StrCat("candidate.place and candidate.session are ",
                                                   message.place(), " and ", message.session(),
                                                   "; neither may be negative"));
  }
  absl::Status status =
      CheckLength("candidate.session_name", message.session_name(), limits::kMaxNameBytes);
  status.Update(CheckLength("candidate.map", message.map(), limits::kMaxNameBytes));
  status.Update(CheckFinite("candidate.distance", message.distance()));
  status.Update(CheckFinite("candidate.yaw_rad", message.yaw_rad()));
  status.Update(CheckFinite("candidate.lateral_m", message.lateral_m()));
  if (message.has_confidence()) {
    status.Update(CheckRange("candidate.confidence", message.confidence(), 0.0, 1.0));
  }
  return status;
}

absl::StatusOr<Candidate> FromProto(const v1::Candidate& message) {
  RETURN_IF_ERROR(Check(message));
  ASSIGN_OR_RETURN(const auto T_map_place,
                   PoseFromProto("candidate.T_map_place", message.t_map_place()));
  ASSIGN_OR_RETURN(const auto T_map_query,
                   PoseFromProto("candidate.T_map_query", message.t_map_query()));

  Candidate candidate;
  candidate.place = message.place();
  candidate.session = message.session();
  candidate.session_name = message.session_name();
  candidate.map = message.map();
  candidate.T_map_place = T_map_place;
  candidate.distance = message.distance();
  if (message.has_confidence()) candidate.confidence = message.confidence();
  candidate.yaw_rad = message.yaw_rad();
  candidate.lateral_m = message.lateral_m();
  candidate.T_map_query = T_map_query;
  if (message.covariance_size() > 0) {
    constexpr int kNumElements = 36;
    if (message.covariance_size() != kNumElements) {
      return absl::InvalidArgumentError(absl::StrCat(
          "candidate.covariance has ", message.covariance_size(), " numbers; it must have 36"));
    }
    for (int i = 0; i < kNumElements; ++i) {
      if (i == 0) candidate.covariance.emplace();
      (*candidate.covariance)(i / 6, i % 6) = message.covariance(i);
    }
    RETURN_IF_ERROR(CheckCovariance(*candidate.covariance));
  }
  if (message.has_geo()) {
    ASSIGN_OR_RETURN(candidate.geo, GeoPoseFromProto("candidate.geo", message.geo()));
  }
  return candidate;
}

v1::Candidate ToProto(const Candidate& candidate) {
  v1::Candidate message;
  message.set_place(candidate.place);
  message.set_session(candidate.session);
  message.set_session_name(candidate.session_name);
  message.set_map(candidate.map);
  *message.mutable_t_map_place() = PoseToProto(candidate.T_map_place);
  message.set_distance(candidate.distance);
  if (candidate.confidence) message.set_confidence(*candidate.confidence);
  message.set_yaw_rad(candidate.yaw_rad);
  message.set_lateral_m(candidate.lateral_m);
  *message.mutable_t_map_query() = PoseToProto(candidate.T_map_query);
  if (candidate.covariance) {
    for (int i = 0; i < 36; ++i) message.add_covariance((*candidate.covariance)(i / 6, i % 6));
  }
  if (candidate.geo) *message.mutable_geo() = GeoPoseToProto(*candidate.geo);
  return message;
}

ScanCounts FromProto(const v1::ScanCounts& message) {
  return {.num_points = message.num_points(),
          .num_not_finite = message.num_not_finite(),
          .num_beyond_limit = message.num_beyond_limit(),
          .num_voxels = message.num_voxels(),
          .num_masked = message.num_masked()};
}

v1::ScanCounts ToProto(const ScanCounts& counts) {
  v1::ScanCounts message;
  message.set_num_points(counts.num_points);
  message.set_num_not_finite(counts.num_not_finite);
  message.set_num_beyond_limit(counts.num_beyond_limit);
  message.set_num_voxels(counts.num_voxels);
  message.set_num_masked(counts.num_masked);
  return message;
}

}  // namespace

absl::StatusOr<LocalizeReply> FromProto(const v1::LocalizeResponse& message) {
  absl::Status status = CheckAskedMap(message.map());
  status.Update(CheckLength("content_id", message.content_id(), kMaxContentIdBytes));
  status.Update(CheckLength("reason", message.reason(), kMaxReasonBytes));
  status.Update(CheckLength("frame_id", message.frame_id(), limits::kMaxNameBytes));
  if (message.candidates_size() > limits::kMaxCandidates) {
    status.Update(absl::InvalidArgumentError(
        absl::StrCat("the answer has ", message.candidates_size(), " candidates; at most ",
                     limits::kMaxCandidates, " are allowed")));
  }
  status.Update(CheckEnum("outcome", message.outcome(), v1::Outcome_MAX));
  if (!status.ok()) return status;

  LocalizeReply reply;
  reply.map = message.map();
  reply.answer.outcome = static_cast<Outcome>(message.outcome());
  reply.answer.reason = message.reason();
  reply.answer.content_id = message.content_id();
  reply.answer.candidates.reserve(message.candidates_size());
  for (const v1::Candidate& candidate : message.candidates()) {
    ASSIGN_OR_RETURN(auto converted, FromProto(candidate));
    reply.answer.candidates.push_back(std::move(converted));
  }
  reply.queue_ns = message.times().queue_ns();
  reply.decode_ns = message.times().decode_ns();
  reply.answer.times = {.describe_ns = message.times().describe_ns(),
                        .retrieve_ns = message.times().retrieve_ns(),
                        .match_ns = message.times().match_ns(),
                        .verify_ns = message.times().verify_ns()};
  if (message.has_scan_counts()) reply.scan_counts = FromProto(message.scan_counts());
  reply.header = {.stamp_ns = message.stamp_ns(), .frame_id = message.frame_id()};
  return reply;
}

v1::LocalizeResponse ToProto(const LocalizeReply& reply) {
  v1::LocalizeResponse message;
  message.set_map(reply.map);
  message.set_content_id(reply.answer.content_id);
  message.set_outcome(static_cast<v1::Outcome>(reply.answer.outcome));
  message.set_reason(reply.answer.reason);
  for (const Candidate& candidate : reply.answer.candidates) {
    *message.add_candidates() = ToProto(candidate);
  }
  v1::StageTimes& times = *message.mutable_times();
  times.set_queue_ns(reply.queue_ns);
  times.set_decode_ns(reply.decode_ns);
  times.set_describe_ns(reply.answer.times.describe_ns);
  times.set_retrieve_ns(reply.answer.times.retrieve_ns);
  times.set_match_ns(reply.answer.times.match_ns);
  times.set_verify_ns(reply.answer.times.verify_ns);
  if (reply.scan_counts) *message.mutable_scan_counts() = ToProto(*reply.scan_counts);
  message.set_stamp_ns(reply.header.stamp_ns);
  message.set_frame_id(reply.header.frame_id);
  return message;
}

absl::StatusOr<std::optional<Pose>> OdometryFromProto(const v1::StreamScan& message) {
  if (!message.has_t_last_scan()) return std::nullopt;
  ASSIGN_OR_RETURN(const auto pose, PoseFromProto("T_last_scan", message.t_last_scan()));
  return pose;
}

void SetOdometry(const std::optional<Pose>& T_last_scan, v1::StreamScan* message) {
  if (T_last_scan) *message->mutable_t_last_scan() = PoseToProto(*T_last_scan);
}

absl::StatusOr<TrackedReply> FromProto(const v1::TrackedAnswer& message) {
  ASSIGN_OR_RETURN(auto reply, FromProto(message.answer()));
  if (message.num_scans() < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("num_scans is ", message.num_scans(), "; it must not be negative"));
  }
  return TrackedReply{std::move(reply), message.num_scans(), message.relocated()};
}

v1::TrackedAnswer ToProto(const TrackedReply& reply) {
  v1::TrackedAnswer message;
  *message.mutable_answer() = ToProto(reply.reply);
  message.set_num_scans(reply.num_scans);
  message.set_relocated(reply.is_relocated);
  return message;
}

}  // namespace scanloc::proto

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/v1/capture.pb.h"

namespace scanloc::proto {
namespace {

v1::Method ToProto(const Method& method) {
  if (method.automatic) return v1::METHOD_AUTO;
  if (method.kind == DescriptorKind::kPolar) {
    return method.augmented ? v1::METHOD_A_PC : v1::METHOD_PC;
  }
  return method.augmented ? v1::METHOD_A_CC : v1::METHOD_CC;
}

absl::Status SetMethod(const v1::LocalizeOptions& message, Query* query) {
  Method method{.naive_alignment = message.naive_alignment(), .brute_force = message.brute_force()};
  const v1::Method name = message.method();
  switch (name) {
    case v1::METHOD_PC:
    case v1::METHOD_A_PC:
      method.kind = DescriptorKind::kPolar;
      break;
    case v1::METHOD_CC:
    case v1::METHOD_A_CC:
      method.kind = DescriptorKind::kCart;
      break;
    case v1::METHOD_AUTO:
      method.automatic = true;
      [[fallthrough]];
    case v1::METHOD_UNSPECIFIED:
      if (!method.naive_alignment && !method.brute_force) break;
      return absl::InvalidArgumentError(
          "options.naive_alignment and options.brute_force go with the methods PC, CC, A_PC and "
          "A_CC only");
    default:
      return absl::InvalidArgumentError(absl::StrCat("options.method is ", static_cast<int>(name),
                                                     ", which is none; see enum Method"));
  }
  method.augmented = name != v1::METHOD_PC && name != v1::METHOD_CC;
  if (name != v1::METHOD_UNSPECIFIED) query->method = method;
  return absl::OkStatus();
}

absl::StatusOr<Prior> FromProto(const v1::Prior& message) {
  Prior prior;
  if (message.has_disc()) {
    const v1::Prior::Disc& disc = message.disc();
    prior.disc = {.x_m = disc.x_m(), .y_m = disc.y_m(), .radius_m = disc.radius_m()};
  }
  if (message.has_heights()) {
    prior.heights = {.min_m = message.heights().min_m(), .max_m = message.heights().max_m()};
  }
  if (message.has_on_earth()) {
    const v1::Prior::GeoDisc& disc = message.on_earth();
    prior.on_earth = {.latitude_deg = disc.latitude_deg(),
                      .longitude_deg = disc.longitude_deg(),
                      .radius_m = disc.radius_m()};
  }
  for (const std::string& session : message.sessions()) {
    RETURN_IF_ERROR(CheckLength("options.prior.sessions", session, limits::kMaxNameBytes));
    prior.sessions.push_back(session);
  }
  if (auto status = Validate(prior); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("options.prior: ", status.message()));
  }
  return prior;
}

v1::Prior ToProto(const Prior& prior) {
  v1::Prior message;
  if (prior.disc) {
    message.mutable_disc()->set_x_m(prior.disc->x_m);
    message.mutable_disc()->set_y_m(prior.disc->y_m);
    message.mutable_disc()->set_radius_m(prior.disc->radius_m);
  }
  if (prior.heights) {
    message.mutable_heights()->set_min_m(prior.heights->min_m);
    message.mutable_heights()->set_max_m(prior.heights->max_m);
  }
  if (prior.on_earth) {
    message.mutable_on_earth()->set_latitude_deg(prior.on_earth->latitude_deg);
    message.mutable_on_earth()->set_longitude_deg(prior.on_earth->longitude_deg);
    message.mutable_on_earth()->set_radius_m(prior.on_earth->radius_m);
  }
  message.mutable_sessions()->Add(prior.sessions.begin(), prior.sessions.end());
  return message;
}

// Absent, or in [0, 1].
absl::Status CheckShare(const char* field, bool is_set, double value) {
  return is_set ? CheckRange(field, value, 0.0, 1.0) : absl::OkStatus();
}

}  // namespace

absl::Status CheckAskedMap(const std::string& name) {
  return CheckLength("map", name, limits::kMaxNameBytes);
}

// All is checked here, though the Localizer would refuse it too: a query that cannot be answered
// should not cost the description of its scan.
absl::StatusOr<Query> FromProto(const v1::LocalizeOptions& message) {
  Query query;
  RETURN_IF_ERROR(SetMethod(message, &query));
  if (message.has_num_candidates()) {
    RETURN_IF_ERROR(
        CheckRange("options.num_candidates", message.num_candidates(), 1, limits::kMaxCandidates));
    query.num_candidates = message.num_candidates();
  }
  absl::Status status =
      CheckShare("options.threshold", message.has_threshold(), message.threshold());
  status.Update(
      CheckShare("options.min_confidence", message.has_min_confidence(), message.min_confidence()));
  if (!status.ok()) return status;
  if (message.has_threshold()) query.threshold = message.threshold();
  if (message.has_min_confidence()) query.min_confidence = message.min_confidence();
  if (message.has_max_answers()) {
    status = CheckRange("options.max_answers", message.max_answers(), 1, limits::kMaxCandidates);
    if (!status.ok()) return status;
    query.max_answers = message.max_answers();
  }
  if (message.has_prior()) {
    ASSIGN_OR_RETURN(query.prior, FromProto(message.prior()));
  }
  return query;
}

absl::StatusOr<std::chrono::milliseconds> BudgetFromProto(const v1::LocalizeOptions& message) {
  if (!message.has_budget_ms()) return std::chrono::milliseconds(0);
  RETURN_IF_ERROR(CheckRange("options.budget_ms", message.budget_ms(), 1,
                             std::numeric_limits<std::int32_t>::max()));
  return std::chrono::milliseconds(message.budget_ms());
}

v1::LocalizeOptions ToProto(const Query& query, std::chrono::milliseconds budget) {
  v1::LocalizeOptions message;
  if (query.method) {
    message.set_method(ToProto(*query.method));
    message.set_naive_alignment(query.method->naive_alignment);
    message.set_brute_force(query.method->brute_force);
  }
  if (query.num_candidates) message.set_num_candidates(*query.num_candidates);
  if (query.threshold) message.set_threshold(*query.threshold);
  if (query.min_confidence) message.set_min_confidence(*query.min_confidence);
  if (budget.count() != 0) {
    constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
    message.set_budget_ms(static_cast<std::int32_t>(
        std::clamp<std::chrono::milliseconds::rep>(budget.count(), -1, kMost)));
  }
  message.set_max_answers(query.max_answers);
  if (!query.prior.is_open()) *message.mutable_prior() = ToProto(query.prior);
  return message;
}

absl::StatusOr<CapturedQuery> ParseCapturedQuery(const std::string& bytes) {
  v1::CapturedQuery message;
  if (!message.ParseFromString(bytes)) {
    return absl::InvalidArgumentError("the bytes are not a captured query");
  }
  const v1::LocalizeRequest& request = message.request();
  CapturedQuery captured{.request_id = message.request_id(), .map = request.map()};
  RETURN_IF_ERROR(CheckAskedMap(captured.map));
  ASSIGN_OR_RETURN(captured.query, FromProto(request.options()));
  ASSIGN_OR_RETURN(captured.header, HeaderFromProto(request));
  ASSIGN_OR_RETURN(captured.budget, BudgetFromProto(request.options()));
  ASSIGN_OR_RETURN(captured.reply, FromProto(message.response()));
  if (request.has_scan()) {
    RETURN_IF_ERROR(FromProto(request.scan(), &captured.scan));
    ASSIGN_OR_RETURN(captured.mount, MountFromProto(request.scan()));
  } else if (request.has_descriptors()) {
    ASSIGN_OR_RETURN(captured.descriptor, FromProto(request.descriptors()));
  } else {
    return absl::InvalidArgumentError("the captured query has neither scan nor descriptors");
  }
  return captured;
}

}  // namespace scanloc::proto

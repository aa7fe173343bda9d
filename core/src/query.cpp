#include "scanloc/core/query.hpp"

#include "absl/strings/str_format.h"
#include "scanloc/core/limits.hpp"

namespace scanloc {
namespace {

absl::Status CheckCount(const char* name, int value) {
  if (value >= 1 && value <= limits::kMaxCandidates) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat("the number of %s is %d; it must be in [1, %d]",
                                                    name, value, limits::kMaxCandidates));
}

absl::Status CheckShare(const char* name, const std::optional<double>& value) {
  if (!value || (*value >= 0.0 && *value <= 1.0)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("%s is %g; it must be in [0, 1]", name, *value));
}

}  // namespace

Method MethodOf(const Query& query, const Params& params) {
  return query.method.value_or(DefaultMethod(params));
}

absl::Status Validate(const Query& query, const Params& params) {
  absl::Status status = CheckCount("candidates", query.num_candidates.value_or(1));
  status.Update(CheckCount("answers", query.max_answers));
  status.Update(CheckShare("threshold", query.threshold));
  status.Update(CheckShare("min_confidence", query.min_confidence));
  status.Update(Validate(query.prior));
  if (!status.ok()) return status;
  const Method method = MethodOf(query, params);
  if (method.automatic && query.threshold) {
    return absl::InvalidArgumentError(
        "a threshold is for the methods that compare descriptors; auto takes a least confidence");
  }
  if (!method.automatic && query.min_confidence) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "a least confidence is for the method auto; %s takes a threshold", MethodName(method)));
  }
  return CheckServes(params, method);
}

}  // namespace scanloc

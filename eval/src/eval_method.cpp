#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/eval/baseline.hpp"
#include "scanloc/eval/evaluation.hpp"
#include "scanloc/eval/intensity_contexts.hpp"

namespace scanloc::eval {

absl::StatusOr<EvalMethod> ParseEvalMethod(const std::string& text) {
  EvalMethod result;
  result.name = text;
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  std::unique_ptr<Baseline> baseline = MakeBaseline(name);
  if (baseline == nullptr) baseline = MakeIntensityContexts(name, {});
  if (baseline != nullptr) {
    result.is_baseline = true;
    result.baseline = name;
    if (colon != std::string::npos && !baseline->takes_candidates()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "\"", text, "\": ", name, " ranks all places and takes no number of candidates"));
    }
  } else {
    absl::StatusOr<Method> method = ParseMethod(name);
    if (!method.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat(method.status().message(), "; or one of the baselines ", BaselineNames()));
    }
    result.method = *method;
  }
  if (colon == std::string::npos) return result;
  int k = 0;
  if (!absl::SimpleAtoi(text.substr(colon + 1), &k) || k < 1 || k > limits::kMaxCandidates) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\": the number of candidates behind ",
                     "the colon must be in [1, ", limits::kMaxCandidates, "]"));
  }
  result.num_candidates = k;
  return result;
}

absl::Status CheckServes(const Params& params, const EvalMethod& method) {
  if (!method.is_baseline) return scanloc::CheckServes(params, method.method);
  const std::unique_ptr<Baseline> baseline = MakeBaseline(method.baseline);
  const std::optional<DescriptorKind> kind =
      baseline == nullptr ? std::nullopt : baseline->context_kind();
  return kind ? scanloc::CheckServes(params, Method{.kind = *kind}) : absl::OkStatus();
}

}  // namespace scanloc::eval

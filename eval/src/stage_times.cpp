#include "stage_times.hpp"

#include <algorithm>
#include <ctime>
#include <optional>
#include <utility>

#include "scanloc/core/status_macros.hpp"
#include "scanloc/eval/ground_truth.hpp"
#include "scanloc/eval/quantile.hpp"

namespace scanloc::eval {
namespace {

/// The parameters of a map that serves this method and no other. None for a baseline that describes
/// scans in its own way.
std::optional<Params> ParamsOfAlone(const EvalSubjects& subjects, const EvalMethod& method) {
  Params params = subjects.localizer.map().params;
  if (!method.is_baseline && method.method.automatic) return params;
  std::optional<DescriptorKind> kind = method.method.kind;
  bool augmented = method.method.augmented;
  if (method.is_baseline) {
    kind = subjects.baselines.at(method.baseline)->context_kind();
    augmented = method.baseline.starts_with("a-");
  }
  if (!kind) return std::nullopt;
  params.structure.enabled = false;
  params.polar.enabled = *kind == DescriptorKind::kPolar;
  params.cart.enabled = *kind == DescriptorKind::kCart;
  if (!augmented) params.polar.root_shifts_m.clear();
  return params;
}

/// One method, and its times so far.
struct Timed {
  std::optional<Describer> describer;
  std::vector<double> describe_ms, describe_place_ms, retrieve_ms, match_ms, verify_ms, total_ms;
};

double ToMs(std::int64_t ns) { return 1e-6 * static_cast<double>(ns); }

absl::Status TimeOnce(const EvalSubjects& subjects, const EvalMethod& method,
                      const EvalQuestion& question, bool time_places, Timed* timed) {
  std::int64_t describe_ns = 0;
  std::int64_t describe_place_ns = 0;
  if (timed->describer) {
    const std::int64_t start_ns = ThreadNow_ns();
    const ScanDescriptor described = timed->describer->Describe(question.scan);
    describe_ns = ThreadNow_ns() - start_ns;
    if (time_places) {
      const std::int64_t place_start_ns = ThreadNow_ns();
      const PlaceDescriptor place = timed->describer->DescribePlace(question.scan);
      describe_place_ns = ThreadNow_ns() - place_start_ns;
    }
  }
  ASSIGN_OR_RETURN(const Answer answer, Ask(subjects, method, question));
  const StageTimes& times = answer.times;
  if (!timed->describer) describe_place_ns = describe_ns = times.describe_ns;
  timed->describe_ms.push_back(ToMs(describe_ns));
  timed->describe_place_ms.push_back(ToMs(describe_place_ns));
  timed->retrieve_ms.push_back(ToMs(times.retrieve_ns));
  timed->match_ms.push_back(ToMs(times.match_ns));
  timed->verify_ms.push_back(ToMs(times.verify_ns));
  timed->total_ms.push_back(
      ToMs(describe_ns + times.retrieve_ns + times.match_ns + times.verify_ns));
  return absl::OkStatus();
}

StageMeans MeansOf(const Timed& timed) {
  const auto mean = [](const std::vector<double>& values) { return Mean(values).value_or(0.0); };
  return {.describe_ms = mean(timed.describe_ms),
          .describe_place_ms = mean(timed.describe_place_ms),
          .retrieve_ms = mean(timed.retrieve_ms),
          .match_ms = mean(timed.match_ms),
          .verify_ms = mean(timed.verify_ms),
          .total_ms = mean(timed.total_ms),
          .total_p99_ms = Quantile(timed.total_ms, 0.99).value_or(0.0)};
}

}  // namespace

std::int64_t ThreadNow_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

absl::StatusOr<std::vector<StageMeans>> MeasureTimes(const EvalSubjects& subjects,
                                                     const std::vector<EvalQuery>& queries,
                                                     const EvalOptions& options) {
  ASSIGN_OR_RETURN(Describer common, Describer::Create(subjects.localizer.map().params));
  std::vector<Timed> timed(options.methods.size());
  for (std::size_t i = 0; i < timed.size(); ++i) {
    const std::optional<Params> params = ParamsOfAlone(subjects, options.methods[i]);
    if (!params) continue;
    ASSIGN_OR_RETURN(timed[i].describer, Describer::Create(*params));
  }
  const std::size_t num_timed = std::min(options.num_timed, queries.size());
  // The first is asked twice: what it needs for the first time is not counted.
  for (std::size_t turn = 0; turn < num_timed + 1 && num_timed > 0; ++turn) {
    const std::size_t number = (turn == 0 ? 0 : turn - 1) * queries.size() / num_timed;
    ASSIGN_OR_RETURN(const PointCloud scan, ReadQuery(number, options));
    const std::vector<bool> hidden =
        HiddenPlaces(subjects.localizer.map().places, queries[number].sees_until_ns);
    const ScanDescriptor descriptor = common.Describe(scan);
    for (std::size_t i = 0; i < timed.size(); ++i) {
      RETURN_IF_ERROR(TimeOnce(subjects, options.methods[i], {scan, descriptor, hidden, number},
                               options.time_places, &timed[i]));
      if (turn == 0) timed[i] = {.describer = std::move(timed[i].describer)};
    }
  }
  std::vector<StageMeans> means;
  means.reserve(timed.size());
  for (const Timed& one : timed) means.push_back(MeansOf(one));
  return means;
}

}  // namespace scanloc::eval

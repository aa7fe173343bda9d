#include "scanloc/eval/evaluation.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/eval/ground_truth.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "stage_times.hpp"

namespace scanloc::eval {
namespace {

constexpr int kNumReliabilityBins = 10;

/// The answers of all methods to one scan.
using Answers = std::vector<Answer>;

/// A roll and a pitch that follow from the number: maps points of the scan into the frame of the
/// tilted sensor that is made of it.
Eigen::Quaterniond TiltOf(std::size_t number, double tilt_deg) {
  std::mt19937_64 random(number + 1);
  const auto draw_rad = [&] {
    const double share = static_cast<double>(random() >> 11) / static_cast<double>(1ULL << 53);
    return (2.0 * share - 1.0) * tilt_deg * std::numbers::pi / 180.0;
  };
  const Eigen::AngleAxisd roll(draw_rad(), Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd pitch(draw_rad(), Eigen::Vector3d::UnitY());
  return pitch * roll;
}

absl::StatusOr<Answers> AnswerAll(const EvalSubjects& subjects, std::size_t number,
                                  const EvalQuery& query, const EvalOptions& options,
                                  Describer& describer) {
  ASSIGN_OR_RETURN(const PointCloud scan, ReadQuery(number, options));
  const std::vector<bool> hidden =
      HiddenPlaces(subjects.localizer.map().places, query.sees_until_ns);
  const ScanDescriptor descriptor = describer.Describe(scan);
  Answers answers;
  for (std::size_t i = 0; i < options.methods.size(); ++i) {
    ASSIGN_OR_RETURN(Answer answer,
                     Ask(subjects, options.methods[i], {scan, descriptor, hidden, number}));
    answers.push_back(std::move(answer));
  }
  return answers;
}

/// The vectors of the scan of every place.
absl::StatusOr<std::vector<Eigen::VectorXf>> DescribePlaces(const Baseline& baseline,
                                                            std::size_t num_places,
                                                            const EvalOptions& options) {
  if (!options.read_place) {
    return absl::InvalidArgumentError(
        absl::StrCat("the baseline ", baseline.name(),
                     " needs the scans that the map was made of; give --map-scans"));
  }
  std::vector<Eigen::VectorXf> vectors(num_places);
  const auto job = [&](std::size_t number, std::size_t /*worker*/) {
    ASSIGN_OR_RETURN(const PointCloud scan, options.read_place(number));
    vectors[number] = baseline.Describe(scan);
    return absl::OkStatus();
  };
  RETURN_IF_ERROR(RunJobs(NumThreads(options.num_threads), num_places, job, [](std::size_t) {}));
  return vectors;
}

absl::Status PrepareBaselines(const EvalOptions& options, EvalSubjects* subjects) {
  const Map& map = subjects->localizer.map();
  for (const EvalMethod& method : options.methods) {
    if (!method.is_baseline || subjects->baselines.contains(method.baseline)) continue;
    std::shared_ptr<Baseline> baseline = MakeBaseline(method.baseline, map.params);
    for (const std::shared_ptr<Baseline>& own : options.baselines) {
      if (own->name() == method.baseline) baseline = own;
    }
    if (baseline == nullptr) {
      return absl::InvalidArgumentError(absl::StrCat(
          method.name,
          " works on what the scans of an evaluation do not hold; `scanloc eval` reads "
          "it"));
    }
    std::vector<Eigen::VectorXf> vectors;
    if (baseline->needs_place_scans()) {
      ASSIGN_OR_RETURN(vectors, DescribePlaces(*baseline, map.places.size(), options));
    }
    baseline->Prepare(map, std::move(vectors));
    subjects->baselines[method.baseline] = std::move(baseline);
  }
  return absl::OkStatus();
}

/// How many places a method looks at; more than any map has where it ranks all of them.
int NumCandidates(const EvalMethod& method, const EvalSubjects& subjects) {
  constexpr int kAll = std::numeric_limits<int>::max();
  if (method.is_baseline && !subjects.baselines.at(method.baseline)->takes_candidates()) {
    return kAll;
  }
  if (!method.is_baseline && method.method.brute_force) return kAll;
  if (!method.is_baseline && method.method.automatic) return method.num_candidates.value_or(kAll);
  return method.num_candidates.value_or(subjects.localizer.map().params.search.num_candidates);
}

void MeasureDivergences(const std::vector<EvalQuery>& queries, MethodResult* result) {
  std::vector<RevisitVariance> variances;
  variances.reserve(queries.size());
  for (const EvalQuery& query : queries) variances.push_back(query.variance);
  const PrecisionRecall& curve = result->precision_recall;
  const auto measure = [&](std::optional<RevisitKind> kind) {
    return MeasureDivergences(variances, result->scored, curve.points, result->within_m, kind);
  };
  const auto at_best = [&](const std::vector<double>& divergences) {
    std::optional<double> value;
    if (curve.best && !divergences.empty() && !std::isnan(divergences[*curve.best])) {
      value = divergences[*curve.best];
    }
    return value;
  };
  result->divergences = measure(std::nullopt);
  result->divergence_at_f1_max = at_best(result->divergences);
  for (std::size_t kind = 0; kind < kNumKinds; ++kind) {
    result->kind_divergences[kind] = measure(static_cast<RevisitKind>(kind));
    result->kind_divergence_at_f1_max[kind] = at_best(result->kind_divergences[kind]);
  }
}

/// What the answers of one method are worth.
MethodResult Measure(const EvalMethod& method, std::size_t index,
                     const std::vector<EvalQuery>& queries, const std::vector<Answers>& answers,
                     double within_m, double tilt_deg) {
  MethodResult result;
  result.name = method.name;
  result.within_m = within_m;
  result.tells_outcome = !method.is_baseline;
  std::vector<ScoredQuery> confident;
  std::vector<double> position_m, lateral_m, yaw_deg;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    QueryTruth truth;
    if (queries[i].T_map_true) {
      truth.T_map_query = *queries[i].T_map_true * TiltOf(i, tilt_deg).conjugate();
    }
    if (queries[i].has_place) truth.nearest = queries[i].variance;
    const std::vector<Candidate>& candidates = answers[i][index].candidates;
    const Judgement judgement = Judge(truth, candidates, within_m);
    result.scored.push_back(judgement.scored);
    result.outcomes.Add(answers[i][index], judgement);
    result.told.push_back({answers[i][index].outcome, judgement.error});
    if (judgement.scored.is_revisit) result.first_right.push_back(judgement.first_right);
    result.num_right_beyond += judgement.is_right_beyond ? 1 : 0;
    result.matched_m.emplace_back(Eigen::Vector2d::Zero());
    if (candidates.empty()) continue;
    result.matched_m.back() = candidates.front().T_map_query.translation().head<2>();
    if (candidates.front().confidence) {
      confident.push_back({.has_match = true,
                           .is_right = judgement.is_pose_right,
                           .score = judgement.scored.score});
    }
    if (!judgement.scored.is_right || method.is_baseline) continue;
    position_m.push_back(judgement.error->off.plane_m);
    lateral_m.push_back(judgement.error->lateral_m);
    yaw_deg.push_back(judgement.error->off.heading_deg);
  }
  result.precision_recall = MeasurePrecisionRecall(result.scored);
  if (!confident.empty()) {
    result.reliability = MeasureReliability(confident, kNumReliabilityBins);
  }
  MeasureDivergences(queries, &result);
  result.position_m = Summarize(position_m);
  result.lateral_m = Summarize(lateral_m);
  result.yaw_deg = Summarize(yaw_deg);
  return result;
}

}  // namespace

void FindRevisits(const Map& map, double within_m, std::vector<EvalQuery>* queries) {
  for (EvalQuery& query : *queries) {
    std::optional<RevisitVariance> nearest;
    if (query.T_map_true) {
      nearest = NearestPlace(map.places, HiddenPlaces(map.places, query.sees_until_ns),
                             *query.T_map_true);
    }
    query.has_place = nearest.has_value();
    query.variance = nearest.value_or(RevisitVariance{});
    query.is_revisit = IsRevisit(nearest, within_m);
  }
}

absl::StatusOr<PointCloud> ReadQuery(std::size_t number, const EvalOptions& options) {
  absl::StatusOr<PointCloud> scan = options.read_query(number);
  if (!scan.ok() || options.tilt_deg <= 0.0) return scan;
  const Eigen::Matrix3f turn = TiltOf(number, options.tilt_deg).toRotationMatrix().cast<float>();
  for (Point& point : *scan) {
    const Eigen::Vector3f turned = turn * Eigen::Vector3f(point.x, point.y, point.z);
    point = {turned.x(), turned.y(), turned.z()};
  }
  return scan;
}

absl::StatusOr<Answer> Ask(const EvalSubjects& subjects, const EvalMethod& method,
                           const EvalQuestion& question) {
  const std::vector<bool>* excluded = question.hidden.empty() ? nullptr : &question.hidden;
  if (method.is_baseline) {
    return subjects.baselines.at(method.baseline)
        ->Recognize({.scan = question.scan,
                     .descriptor = question.descriptor,
                     .number = question.number,
                     .num_answers = kNumAnswers,
                     .num_candidates = method.num_candidates,
                     .excluded = excluded,
                     .now_ns = &ThreadNow_ns});
  }
  return subjects.localizer.Localize(question.descriptor,
                                     {.method = method.method,
                                      .num_candidates = method.num_candidates,
                                      .max_answers = kNumAnswers},
                                     {.now_ns = &ThreadNow_ns, .excluded = excluded});
}

absl::StatusOr<std::vector<MethodResult>> Evaluate(const Localizer& localizer,
                                                   const std::vector<EvalQuery>& queries,
                                                   const EvalOptions& options,
                                                   const std::function<void(std::size_t)>& told) {
  EvalSubjects subjects{.localizer = localizer, .baselines = {}};
  RETURN_IF_ERROR(PrepareBaselines(options, &subjects));
  const std::size_t num_threads = NumThreads(options.num_threads);
  ASSIGN_OR_RETURN(std::vector<Describer> describers,
                   MakeDescribers(localizer.map().params, num_threads));
  std::vector<Answers> answers(queries.size());
  const auto job = [&](std::size_t number, std::size_t worker) {
    absl::StatusOr<Answers> all =
        AnswerAll(subjects, number, queries[number], options, describers[worker]);
    absl::Status status = all.status();
    if (status.ok()) answers[number] = *std::move(all);
    return status;
  };
  RETURN_IF_ERROR(RunJobs(num_threads, queries.size(), job, told));
  ASSIGN_OR_RETURN(const std::vector<StageMeans> times, MeasureTimes(subjects, queries, options));
  std::vector<MethodResult> results;
  for (const double within_m : options.within_m) {
    for (std::size_t i = 0; i < options.methods.size(); ++i) {
      results.push_back(
          Measure(options.methods[i], i, queries, answers, within_m, options.tilt_deg));
      results.back().num_candidates = NumCandidates(options.methods[i], subjects);
      results.back().times = times[i];
    }
  }
  return results;
}

}  // namespace scanloc::eval

#include "cli/evaluation.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <numbers>
#include <thread>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "cli/query_result.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc::cli {
namespace {

constexpr int kNumAnswers = 10;
constexpr int kNumReliabilityBins = 10;

std::int64_t NowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double PlanarDistance(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).head<2>().norm();
}

/// The answers of all methods to one scan.
using Answers = std::vector<Answer>;

absl::StatusOr<Answers> AnswerAll(const Localizer& localizer, const EvalQuery& query,
                                  const EvalOptions& options, Describer& describer) {
  const absl::StatusOr<dataset::Scan> scan = dataset::ReadScan(query.path);
  if (!scan.ok()) return scan.status();
  const std::int64_t start_ns = NowNs();
  const ScanDescriptor descriptor = describer.Describe(scan->points);
  const std::int64_t describe_ns = NowNs() - start_ns;
  Answers answers;
  for (const EvalMethod& method : options.methods) {
    absl::StatusOr<Answer> answer =
        localizer.Localize(descriptor, {.method = method.method,
                                        .num_candidates = method.num_candidates,
                                        .max_answers = kNumAnswers,
                                        .now_ns = &NowNs});
    if (!answer.ok()) return answer.status();
    answer->times.describe_ns = describe_ns;
    answers.push_back(*std::move(answer));
  }
  return answers;
}

/// Runs AnswerAll for every query on threads.
class EvalRun {
 public:
  EvalRun(const Localizer& localizer, const std::vector<EvalQuery>& queries,
          const EvalOptions& options)
      : localizer_(localizer), queries_(queries), options_(options), answers_(queries.size()) {}

  absl::StatusOr<std::vector<Answers>> Run(const std::function<void(std::size_t)>& told) {
    const unsigned num_wanted = options_.num_threads > 0
                                    ? static_cast<unsigned>(options_.num_threads)
                                    : std::max(1U, std::thread::hardware_concurrency());
    std::vector<Describer> describers;
    for (unsigned i = 0; i < num_wanted; ++i) {
      absl::StatusOr<Describer> describer = Describer::Create(localizer_.map().params);
      if (!describer.ok()) return describer.status();
      describers.push_back(*std::move(describer));
    }
    num_working_ = describers.size();
    std::vector<std::thread> threads;
    threads.reserve(describers.size());
    for (Describer& describer : describers) {
      threads.emplace_back([this, &describer] { Work(describer); });
    }
    std::unique_lock lock(mutex_);
    while (num_working_ > 0) {
      has_news_.wait(lock);
      const std::size_t num_done = num_done_;
      lock.unlock();
      told(num_done);
      lock.lock();
    }
    lock.unlock();
    for (std::thread& thread : threads) thread.join();
    if (!error_.ok()) return error_;
    return std::move(answers_);
  }

 private:
  void Work(Describer& describer) {
    while (true) {
      const std::size_t i = next_.fetch_add(1);
      absl::Status status;
      const bool is_over = i >= queries_.size() || has_failed_;
      if (!is_over) {
        absl::StatusOr<Answers> answers = AnswerAll(localizer_, queries_[i], options_, describer);
        status = answers.status();
        if (answers.ok()) answers_[i] = *std::move(answers);
      }
      const std::lock_guard lock(mutex_);
      if (!status.ok()) {
        has_failed_ = true;
        // Of several, the first in order, whichever thread was quicker.
        if (i < error_at_) error_ = status;
        error_at_ = std::min(error_at_, i);
      }
      is_over ? --num_working_ : ++num_done_;
      has_news_.notify_one();
      if (is_over) return;
    }
  }

  const Localizer& localizer_;
  const std::vector<EvalQuery>& queries_;
  const EvalOptions& options_;
  std::vector<Answers> answers_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> has_failed_ = false;
  std::mutex mutex_;
  std::condition_variable has_news_;
  std::size_t num_working_ = 0;
  std::size_t num_done_ = 0;
  std::size_t error_at_ = std::numeric_limits<std::size_t>::max();
  absl::Status error_;
};

/// Rank from 1 of the first right candidate; 0: none.
int FirstRight(const Answer& answer, const EvalQuery& query, double within_m) {
  if (!query.T_map_true) return 0;
  for (std::size_t i = 0; i < answer.candidates.size(); ++i) {
    if (PlanarDistance(answer.candidates[i].T_map_place, *query.T_map_true) <= within_m) {
      return static_cast<int>(i) + 1;
    }
  }
  return 0;
}

std::optional<double> Quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

void MeasureDivergences(const std::vector<EvalQuery>& queries, double within_m,
                        MethodResult* result) {
  eval::RevisitHistogram all(within_m);
  for (const EvalQuery& query : queries) {
    if (query.is_revisit) all.Add(query.variance);
  }
  for (const eval::OperatingPoint& point : result->precision_recall.points) {
    eval::RevisitHistogram found(within_m);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const eval::ScoredQuery& scored = result->scored[i];
      if (scored.is_right && scored.score >= point.threshold) found.Add(queries[i].variance);
    }
    result->divergences.push_back(eval::Divergence(all, found));
    if (point.f1 == result->precision_recall.f1_max) {
      result->divergence_at_f1_max = result->divergences.back();
      result->threshold_at_f1_max = point.threshold;
    }
  }
}

MethodResult Judge(const EvalMethod& method, std::size_t index,
                   const std::vector<EvalQuery>& queries, const std::vector<Answers>& answers,
                   double within_m) {
  MethodResult result;
  result.name = method.name;
  bool has_confidence = false;
  std::vector<double> position_errors_m;
  std::vector<double> yaw_errors_deg;
  double sum_ns = 0.0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const EvalQuery& query = queries[i];
    const Answer& answer = answers[i][index];
    const StageTimes& times = answer.times;
    sum_ns += static_cast<double>(times.describe_ns + times.retrieve_ns + times.match_ns +
                                  times.verify_ns);
    eval::ScoredQuery scored{.is_revisit = query.is_revisit};
    const int first_right = FirstRight(answer, query, within_m);
    if (query.is_revisit) result.first_right.push_back(first_right);
    result.matched_m.emplace_back(Eigen::Vector2d::Zero());
    if (!answer.candidates.empty()) {
      const Candidate& best = answer.candidates.front();
      scored.has_match = true;
      scored.is_right = query.is_revisit && first_right == 1;
      scored.score = best.confidence.value_or(1.0 - best.distance);
      has_confidence |= best.confidence.has_value();
      result.matched_m.back() = best.T_map_query.translation().head<2>();
      if (scored.is_right) {
        const TruthError error = ErrorOf(best, *query.T_map_true);
        position_errors_m.push_back(error.pose_m);
        yaw_errors_deg.push_back(error.yaw_deg);
      }
    }
    result.scored.push_back(scored);
  }
  result.precision_recall = eval::MeasurePrecisionRecall(result.scored);
  if (has_confidence) {
    result.reliability = eval::MeasureReliability(result.scored, kNumReliabilityBins);
  }
  MeasureDivergences(queries, within_m, &result);
  result.median_position_m = Quantile(position_errors_m, 0.5);
  result.p90_position_m = Quantile(position_errors_m, 0.9);
  result.median_yaw_deg = Quantile(yaw_errors_deg, 0.5);
  result.p90_yaw_deg = Quantile(yaw_errors_deg, 0.9);
  result.mean_ms = queries.empty() ? 0.0 : sum_ns / 1e6 / static_cast<double>(queries.size());
  return result;
}

}  // namespace

absl::StatusOr<EvalMethod> ParseEvalMethod(const std::string& text) {
  EvalMethod result;
  result.name = text;
  const std::size_t colon = text.find(':');
  absl::StatusOr<Method> method = ParseMethod(text.substr(0, colon));
  if (!method.ok()) return method.status();
  result.method = *method;
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

void FindRevisits(const Map& map, double within_m, std::vector<EvalQuery>* queries) {
  for (EvalQuery& query : *queries) {
    query.is_revisit = false;
    if (!query.T_map_true || map.places.empty()) continue;
    const auto nearest =
        std::min_element(map.places.begin(), map.places.end(), [&](const Place& a, const Place& b) {
          return PlanarDistance(a.T_map_place, *query.T_map_true) <
                 PlanarDistance(b.T_map_place, *query.T_map_true);
        });
    query.variance.translation_m = PlanarDistance(nearest->T_map_place, *query.T_map_true);
    query.variance.rotation_deg =
        std::abs(Yaw(nearest->T_map_place.inverse() * *query.T_map_true)) * 180.0 /
        std::numbers::pi;
    query.is_revisit = query.variance.translation_m <= within_m;
  }
}

absl::StatusOr<std::vector<MethodResult>> Evaluate(const Localizer& localizer,
                                                   const std::vector<EvalQuery>& queries,
                                                   const EvalOptions& options,
                                                   const std::function<void(std::size_t)>& told) {
  const absl::StatusOr<std::vector<Answers>> answers =
      EvalRun(localizer, queries, options).Run(told);
  if (!answers.ok()) return answers.status();
  std::vector<MethodResult> results;
  for (std::size_t i = 0; i < options.methods.size(); ++i) {
    results.push_back(Judge(options.methods[i], i, queries, *answers, options.within_m));
  }
  return results;
}

}  // namespace scanloc::cli

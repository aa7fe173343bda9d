#include "cli/evaluation.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <numeric>
#include <random>
#include <thread>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "cli/query_result.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/eval/baseline.hpp"

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

/// True where the query does not see the place; empty: it sees all.
std::vector<bool> HiddenFrom(const EvalQuery& query, const Map& map) {
  std::vector<bool> hidden;
  if (!query.sees_until_ns) return hidden;
  hidden.reserve(map.places.size());
  for (const Place& place : map.places) hidden.push_back(place.stamp_ns >= *query.sees_until_ns);
  return hidden;
}

/// What one thread works with.
struct Worker {
  Describer describer;
  std::map<std::string, std::unique_ptr<eval::Baseline>> baselines;  // by name
};

using BaselineIndices = std::map<std::string, eval::BaselineIndex>;  // by name

absl::StatusOr<dataset::Scan> ReadTilted(std::size_t number, const EvalQuery& query,
                                         double tilt_deg) {
  absl::StatusOr<dataset::Scan> scan = dataset::ReadScan(query.file);
  if (!scan.ok() || tilt_deg <= 0.0) return scan;
  const Eigen::Matrix3f turn = TiltOf(number, tilt_deg).toRotationMatrix().cast<float>();
  for (Point& point : scan->points) {
    const Eigen::Vector3f turned = turn * Eigen::Vector3f(point.x, point.y, point.z);
    point = {turned.x(), turned.y(), turned.z()};
  }
  return scan;
}

Answer AnswerByBaseline(const Map& map, eval::Baseline& baseline, const eval::BaselineIndex& index,
                        PointView scan, const std::vector<bool>* hidden) {
  Answer answer;
  const std::int64_t start_ns = NowNs();
  const Eigen::VectorXf vector = baseline.Describe(scan);
  const std::int64_t described_ns = NowNs();
  for (const auto& [number, distance] : index.Search(vector, kNumAnswers, hidden)) {
    const Place& place = map.places[number];
    Candidate candidate;
    candidate.place = static_cast<std::int32_t>(number);
    candidate.distance = distance;
    candidate.T_map_place = place.T_map_place;
    candidate.T_map_query = place.T_map_place;
    answer.candidates.push_back(std::move(candidate));
  }
  answer.times.describe_ns = described_ns - start_ns;
  answer.times.retrieve_ns = NowNs() - described_ns;
  return answer;
}

absl::StatusOr<Answers> AnswerAll(const Localizer& localizer, const BaselineIndices& indices,
                                  std::size_t number, const EvalQuery& query,
                                  const EvalOptions& options, Worker& worker) {
  const absl::StatusOr<dataset::Scan> scan = ReadTilted(number, query, options.tilt_deg);
  if (!scan.ok()) return scan.status();
  const std::vector<bool> hidden = HiddenFrom(query, localizer.map());
  const std::vector<bool>* excluded = hidden.empty() ? nullptr : &hidden;
  const std::int64_t start_ns = NowNs();
  const ScanDescriptor descriptor = worker.describer.Describe(scan->points);
  const std::int64_t describe_ns = NowNs() - start_ns;
  Answers answers;
  for (const EvalMethod& method : options.methods) {
    if (method.is_baseline) {
      answers.push_back(AnswerByBaseline(localizer.map(), *worker.baselines.at(method.name),
                                         indices.at(method.name), scan->points, excluded));
      continue;
    }
    QueryOptions asked;
    asked.method = method.method;
    asked.num_candidates = method.num_candidates;
    asked.max_answers = kNumAnswers;
    asked.now_ns = &NowNs;
    asked.excluded = excluded;
    absl::StatusOr<Answer> answer = localizer.Localize(descriptor, asked);
    if (!answer.ok()) return answer.status();
    answer->times.describe_ns = describe_ns;
    answers.push_back(*std::move(answer));
  }
  return answers;
}

/// Does numbered jobs on threads, each of which has a worker of its own.
class EvalRun {
 public:
  using Job = std::function<absl::Status(std::size_t number, Worker& worker)>;

  EvalRun(const Params& params, const EvalOptions& options) : params_(params), options_(options) {}

  /// The error of the first job, in order, that fails.
  absl::Status Run(std::size_t num_jobs, const Job& job,
                   const std::function<void(std::size_t)>& told) {
    absl::StatusOr<std::vector<Worker>> workers = MakeWorkers();
    if (!workers.ok()) return workers.status();
    num_jobs_ = num_jobs;
    num_working_ = workers->size();
    std::vector<std::thread> threads;
    threads.reserve(workers->size());
    for (Worker& worker : *workers) {
      threads.emplace_back([this, &worker, &job] { Work(worker, job); });
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
    return error_;
  }

 private:
  [[nodiscard]] absl::StatusOr<std::vector<Worker>> MakeWorkers() const {
    const unsigned num_wanted = options_.num_threads > 0
                                    ? static_cast<unsigned>(options_.num_threads)
                                    : std::max(1U, std::thread::hardware_concurrency());
    std::vector<Worker> workers;
    for (unsigned i = 0; i < num_wanted; ++i) {
      absl::StatusOr<Describer> describer = Describer::Create(params_);
      if (!describer.ok()) return describer.status();
      Worker worker{.describer = *std::move(describer), .baselines = {}};
      for (const EvalMethod& method : options_.methods) {
        if (method.is_baseline) worker.baselines[method.name] = eval::MakeBaseline(method.name);
      }
      workers.push_back(std::move(worker));
    }
    return workers;
  }

  void Work(Worker& worker, const Job& job) {
    while (true) {
      const std::size_t i = next_.fetch_add(1);
      absl::Status status;
      const bool is_over = i >= num_jobs_ || has_failed_;
      if (!is_over) status = job(i, worker);
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

  const Params& params_;
  const EvalOptions& options_;
  std::size_t num_jobs_ = 0;
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

double Quantile(const std::vector<double>& sorted, double share) {
  return sorted[std::min(sorted.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(1, values.size()));
}

std::optional<ErrorSummary> Summarize(std::vector<double> errors) {
  if (errors.empty()) return std::nullopt;
  std::sort(errors.begin(), errors.end());
  return ErrorSummary{Quantile(errors, 0.5), Mean(errors), Quantile(errors, 0.9)};
}

/// Divergence of the revisits found from all there are, at each point of the curve; of one kind or
/// of all. Empty where there are none.
std::vector<double> MeasureDivergences(const std::vector<EvalQuery>& queries,
                                       std::optional<eval::RevisitKind> kind,
                                       const MethodResult& result) {
  const auto counts = [&](std::size_t i) {
    return result.scored[i].is_revisit && (!kind || eval::KindOf(queries[i].variance) == *kind);
  };
  eval::RevisitHistogram all(result.within_m);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (counts(i)) all.Add(queries[i].variance);
  }
  std::vector<double> divergences;
  if (all.total() == 0 && kind) return divergences;
  for (const eval::OperatingPoint& point : result.precision_recall.points) {
    eval::RevisitHistogram found(result.within_m);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const eval::ScoredQuery& scored = result.scored[i];
      if (counts(i) && scored.is_right && scored.score >= point.threshold) {
        found.Add(queries[i].variance);
      }
    }
    divergences.push_back(eval::Divergence(all, found));
  }
  return divergences;
}

void MeasureDivergences(const std::vector<EvalQuery>& queries, MethodResult* result) {
  result->divergences = MeasureDivergences(queries, std::nullopt, *result);
  for (int kind = 0; kind < kNumKinds; ++kind) {
    result->kind_divergences[static_cast<std::size_t>(kind)] =
        MeasureDivergences(queries, static_cast<eval::RevisitKind>(kind), *result);
  }
  const std::vector<eval::OperatingPoint>& points = result->precision_recall.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].f1 != result->precision_recall.f1_max) continue;
    result->divergence_at_f1_max = result->divergences[i];
    result->threshold_at_f1_max = points[i].threshold;
    for (std::size_t kind = 0; kind < kNumKinds; ++kind) {
      if (result->kind_divergences[kind].empty()) continue;
      result->kind_divergence_at_f1_max[kind] = result->kind_divergences[kind][i];
    }
  }
}

StageMeans MeasureTimes(const std::vector<Answers>& answers, std::size_t index) {
  StageMeans means;
  std::vector<double> totals_ms;
  const double share = 1e-6 / static_cast<double>(std::max<std::size_t>(1, answers.size()));
  for (const Answers& of_query : answers) {
    const StageTimes& times = of_query[index].times;
    means.describe_ms += share * static_cast<double>(times.describe_ns);
    means.retrieve_ms += share * static_cast<double>(times.retrieve_ns);
    means.match_ms += share * static_cast<double>(times.match_ns);
    means.verify_ms += share * static_cast<double>(times.verify_ns);
    totals_ms.push_back(1e-6 * static_cast<double>(times.describe_ns + times.retrieve_ns +
                                                   times.match_ns + times.verify_ns));
  }
  if (totals_ms.empty()) return means;
  std::sort(totals_ms.begin(), totals_ms.end());
  means.total_ms = Mean(totals_ms);
  means.total_p99_ms = Quantile(totals_ms, 0.99);
  return means;
}

MethodResult Judge(const EvalMethod& method, std::size_t index,
                   const std::vector<EvalQuery>& queries, const std::vector<Answers>& answers,
                   double within_m, double tilt_deg) {
  MethodResult result;
  result.name = method.name;
  result.within_m = within_m;
  std::vector<eval::ScoredQuery> confident;
  std::vector<double> position_errors_m;
  std::vector<double> lateral_errors_m;
  std::vector<double> yaw_errors_deg;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const EvalQuery& query = queries[i];
    const Answer& answer = answers[i][index];
    eval::ScoredQuery scored{.is_revisit =
                                 query.has_place && query.variance.translation_m <= within_m};
    const int first_right = FirstRight(answer, query, within_m);
    if (scored.is_revisit) result.first_right.push_back(first_right);
    result.matched_m.emplace_back(Eigen::Vector2d::Zero());
    if (!answer.candidates.empty()) {
      const Candidate& best = answer.candidates.front();
      scored.has_match = true;
      scored.is_right = scored.is_revisit && first_right == 1;
      scored.score = best.confidence.value_or(1.0 - best.distance);
      // A confidence speaks of the pose, which may be right where no place is near.
      const bool is_pose_right =
          query.T_map_true && PlanarDistance(best.T_map_query, *query.T_map_true) <= within_m;
      if (best.confidence) {
        confident.push_back({.has_match = true, .is_right = is_pose_right, .score = scored.score});
      }
      if (is_pose_right && !scored.is_revisit) {
        ++result.num_right_beyond;
        scored.has_match = false;
      }
      result.matched_m.back() = best.T_map_query.translation().head<2>();
      if (scored.is_right && !method.is_baseline) {
        const Pose T_map_sensor = *query.T_map_true * TiltOf(i, tilt_deg).conjugate();
        const TruthError error = ErrorOf(best, T_map_sensor);
        position_errors_m.push_back(error.pose_m);
        yaw_errors_deg.push_back(error.yaw_deg);
        const Pose T_true_query = query.T_map_true->inverse() * best.T_map_query;
        lateral_errors_m.push_back(std::abs(T_true_query.translation().y()));
      }
    }
    result.scored.push_back(scored);
  }
  result.precision_recall = eval::MeasurePrecisionRecall(result.scored);
  if (!confident.empty()) {
    result.reliability = eval::MeasureReliability(confident, kNumReliabilityBins);
  }
  MeasureDivergences(queries, &result);
  result.position_m = Summarize(std::move(position_errors_m));
  result.lateral_m = Summarize(std::move(lateral_errors_m));
  result.yaw_deg = Summarize(std::move(yaw_errors_deg));
  result.times = MeasureTimes(answers, index);
  return result;
}

/// Describes the scan of every place by every baseline among the methods.
absl::StatusOr<BaselineIndices> IndexBaselines(const Localizer& localizer,
                                               const EvalOptions& options) {
  BaselineIndices indices;
  for (const EvalMethod& method : options.methods) {
    if (method.is_baseline) indices[method.name];
  }
  if (indices.empty()) return indices;
  if (options.place_scans.size() != localizer.map().places.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a baseline needs the scans that the map was made of: ", options.place_scans.size(),
        " are known of ", localizer.map().places.size(), " places"));
  }
  std::vector<std::map<std::string, Eigen::VectorXf>> vectors(options.place_scans.size());
  const absl::Status described = EvalRun(localizer.map().params, options)
                                     .Run(
                                         vectors.size(),
                                         [&](std::size_t number, Worker& worker) {
                                           const absl::StatusOr<dataset::Scan> scan =
                                               dataset::ReadScan(options.place_scans[number]);
                                           if (!scan.ok()) return scan.status();
                                           for (auto& [name, baseline] : worker.baselines) {
                                             vectors[number][name] =
                                                 baseline->Describe(scan->points);
                                           }
                                           return absl::OkStatus();
                                         },
                                         [](std::size_t) {});
  if (!described.ok()) return described;
  for (const auto& of_place : vectors) {
    for (const auto& [name, vector] : of_place) indices[name].Add(vector);
  }
  return indices;
}

}  // namespace

absl::StatusOr<EvalMethod> ParseEvalMethod(const std::string& text) {
  EvalMethod result;
  result.name = text;
  if (eval::MakeBaseline(text) != nullptr) {
    result.is_baseline = true;
    return result;
  }
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
    query.has_place = false;
    if (!query.T_map_true) continue;
    const std::vector<bool> hidden = HiddenFrom(query, map);
    const Place* nearest = nullptr;
    for (std::size_t i = 0; i < map.places.size(); ++i) {
      if (!hidden.empty() && hidden[i]) continue;
      const double distance_m = PlanarDistance(map.places[i].T_map_place, *query.T_map_true);
      if (nearest != nullptr && distance_m >= query.variance.translation_m) continue;
      nearest = &map.places[i];
      query.variance.translation_m = distance_m;
    }
    if (nearest == nullptr) continue;
    query.has_place = true;
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
  const absl::StatusOr<BaselineIndices> indices = IndexBaselines(localizer, options);
  if (!indices.ok()) return indices.status();
  std::vector<Answers> answers(queries.size());
  const absl::Status answered =
      EvalRun(localizer.map().params, options)
          .Run(
              queries.size(),
              [&](std::size_t number, Worker& worker) {
                absl::StatusOr<Answers> all =
                    AnswerAll(localizer, *indices, number, queries[number], options, worker);
                absl::Status status = all.status();
                if (status.ok()) answers[number] = *std::move(all);
                return status;
              },
              told);
  if (!answered.ok()) return answered;
  std::vector<MethodResult> results;
  for (const double within_m : options.within_m) {
    for (std::size_t i = 0; i < options.methods.size(); ++i) {
      results.push_back(Judge(options.methods[i], i, queries, answers, within_m, options.tilt_deg));
    }
  }
  return results;
}

}  // namespace scanloc::cli

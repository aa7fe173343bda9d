#include "ops/metrics.hpp"

#include <dirent.h>
#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <sys/resource.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

#include "front/memory.hpp"
#include "scanloc/server/build_info.hpp"

namespace scanloc::server {
namespace {

using prometheus::Counter;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::MetricType;

constexpr double kSecondsPerNs = 1e-9;

Histogram::BucketBoundaries CallSeconds() {
  return {0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0};
}
Histogram::BucketBoundaries StageSeconds() {
  return {1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.5};
}
Histogram::BucketBoundaries Shares() {
  return {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999};
}

double NumEntries(const char* folder) {
  const std::unique_ptr<DIR, int (*)(DIR*)> open(opendir(folder), closedir);
  if (open == nullptr) return 0.0;
  double count = 0.0;
  while (const dirent* entry = readdir(open.get())) count += entry->d_name[0] == '.' ? 0.0 : 1.0;
  return count;
}

double CpuSeconds() {
  rusage usage = {};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0.0;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// A family of one gauge, or counter, without labels.
prometheus::MetricFamily One(const char* name, const char* help, double value,
                             MetricType type = MetricType::Gauge) {
  prometheus::ClientMetric metric;
  metric.gauge.value = value;
  metric.counter.value = value;
  return {name, help, type, {metric}};
}

/// One gauge a map.
prometheus::MetricFamily MapGauge(const char* name, const char* help,
                                  const std::vector<MapSummary>& maps,
                                  double (*value)(const MapSummary&)) {
  prometheus::MetricFamily family{name, help, MetricType::Gauge, {}};
  for (const MapSummary& map : maps) {
    prometheus::ClientMetric metric;
    metric.label = {{"map", map.name}};
    metric.gauge.value = value(map);
    family.metric.push_back(std::move(metric));
  }
  return family;
}

/// What is not counted but looked up; of the process by the names that Prometheus' own libraries
/// use.
std::vector<prometheus::MetricFamily> LookedUp(const Metrics::Gauges& now) {
  return {
      One("scanloc_queue_depth", "Queries that wait for a thread.", now.num_waiting),
      One("scanloc_in_flight", "Queries that run or wait.", now.num_waiting + now.num_running),
      One("scanloc_streams_open", "Robots on a stream.", now.num_streams),
      One("scanloc_draining", "1 while the server is stopping.", now.is_draining ? 1.0 : 0.0),
      MapGauge("scanloc_map_serving", "1 while the map answers.", now.maps,
               [](const MapSummary& map) { return map.state == MapState::kServing ? 1.0 : 0.0; }),
      MapGauge("scanloc_map_generation", "How often a map was put in service by this name.",
               now.maps, [](const MapSummary& map) { return static_cast<double>(map.generation); }),
      MapGauge("scanloc_map_places", "Places of the map.", now.maps,
               [](const MapSummary& map) { return static_cast<double>(map.num_places); }),
      One("process_resident_memory_bytes", "Memory that the process holds [bytes].",
          static_cast<double>(MeasureMemory().resident_bytes)),
      One("process_open_fds", "Open files and connections.", NumEntries("/proc/self/fd")),
      One("process_threads", "Threads of the process.", NumEntries("/proc/self/task")),
      One("process_cpu_seconds_total", "Processor time used [s].", CpuSeconds(),
          MetricType::Counter),
  };
}

template <typename Builder>
auto& FamilyIn(prometheus::Registry& registry, Builder builder, const char* name,
               const char* help) {
  return builder.Name(name).Help(help).Register(registry);
}

}  // namespace

struct Metrics::State {
  explicit State(std::function<Gauges()> look_up) : look(std::move(look_up)) {
    FamilyIn(registry, prometheus::BuildGauge(), "scanloc_build_info", "Always 1; what is running.")
        .Add({{"version", BuildVersion()}, {"compiler", BuildCompiler()}})
        .Set(1.0);
    // At 0 from the start, so that the first one is seen as a rise.
    for (const char* reason : {"deaf", "memory"}) fronts_made_anew.Add({{"reason", reason}});
  }

  /// Looked up once: most queries have all of them.
  struct Stage {
    Stage(prometheus::Family<Histogram>& family, const char* name)
        : histogram(family.Add({{"stage", name}}, StageSeconds())) {}
    void Add(std::int64_t ns) {
      if (ns > 0) histogram.Observe(kSecondsPerNs * static_cast<double>(ns));
    }
    Histogram& histogram;
  };

  const std::function<Gauges()> look;
  prometheus::Registry registry;
  prometheus::Family<Counter>& calls =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_requests_total",
               "Requests that have ended, by method, status code, map and outcome of the answer.");
  prometheus::Family<Histogram>& call_times =
      FamilyIn(registry, prometheus::BuildHistogram(), "scanloc_request_duration_seconds",
               "From the arrival of a request to its answer [s].");
  prometheus::Family<Histogram>& stages =
      FamilyIn(registry, prometheus::BuildHistogram(), "scanloc_stage_duration_seconds",
               "Time of answered queries by stage [s].");
  Stage queue{stages, "queue"};
  Stage decode{stages, "decode"};
  Stage describe{stages, "describe"};
  Stage retrieve{stages, "retrieve"};
  Stage match{stages, "match"};
  Stage verify{stages, "verify"};
  prometheus::Family<Histogram>& confidences =
      FamilyIn(registry, prometheus::BuildHistogram(), "scanloc_confidence",
               "Confidence of the best candidate of answered queries, by map.");
  prometheus::Family<Counter>& rejections =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_rejected_total",
               "Requests and streams refused before any work was done, by reason.");
  prometheus::Family<Counter>& captures =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_captures_total",
               "Queries without a place, kept for replay or dropped because the disk was slower.");
  prometheus::Family<Gauge>& load_times =
      FamilyIn(registry, prometheus::BuildGauge(), "scanloc_map_load_seconds",
               "How long the last load of the map took, its check included [s].");
  prometheus::Family<Counter>& failed_loads =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_map_reload_failures_total",
               "Loads and reloads that failed; the map before stays in service.");
  prometheus::Family<Gauge>& checked_places =
      FamilyIn(registry, prometheus::BuildGauge(), "scanloc_map_checked_places",
               "Places of the map that were found sound since it was put in service.");
  prometheus::Family<Counter>& damaged_maps =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_map_damaged_total",
               "Times that a map was taken out of service because its file is damaged.");
  prometheus::Family<Counter>& fronts_made_anew =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_front_rebuilds_total",
               "Times that all connections were ended because the server did not answer itself or "
               "clients made it hold too much memory, by reason.");
  prometheus::Family<Counter>& self_checks =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_self_checks_total",
               "Health checks of the server by itself, as a client, by result.");
  prometheus::Family<Counter>& failed_tls_reloads =
      FamilyIn(registry, prometheus::BuildCounter(), "scanloc_tls_reload_failures_total",
               "Changes of the TLS files that were of no use; those before stay in force.");
  prometheus::Family<Gauge>& tls_expiries =
      FamilyIn(registry, prometheus::BuildGauge(), "scanloc_tls_expiry_seconds",
               "When the certificate in force expires [Unix time, s].");
  prometheus::Family<Gauge>& unusable_files =
      FamilyIn(registry, prometheus::BuildGauge(), "scanloc_file_unusable",
               "1 while a file that is read again on change cannot be read, or is bad.");
};

Metrics::Metrics(std::function<Gauges()> look) : state_(std::make_unique<State>(std::move(look))) {}
Metrics::~Metrics() = default;

void Metrics::CountCall(const std::string& method, absl::StatusCode code, const std::string& map,
                        const std::string& outcome, std::optional<double> seconds) {
  state_->calls
      .Add({{"method", method},
            {"code", absl::StatusCodeToString(code)},
            {"map", map},
            {"outcome", outcome}})
      .Increment();
  if (seconds) state_->call_times.Add({{"method", method}}, CallSeconds()).Observe(*seconds);
}

void Metrics::AddReply(const LocalizeReply& reply) {
  const StageTimes& times = reply.answer.times;
  state_->queue.Add(reply.queue_ns);
  state_->decode.Add(reply.decode_ns);
  state_->describe.Add(times.describe_ns);
  state_->retrieve.Add(times.retrieve_ns);
  state_->match.Add(times.match_ns);
  state_->verify.Add(times.verify_ns);
  if (reply.answer.candidates.empty()) return;
  const Candidate& best = reply.answer.candidates.front();
  if (!best.confidence) return;
  state_->confidences.Add({{"map", reply.map}}, Shares()).Observe(*best.confidence);
}

void Metrics::CountRejected(const std::string& reason) {
  state_->rejections.Add({{"reason", reason}}).Increment();
}

void Metrics::CountCaptured(bool kept) {
  state_->captures.Add({{"result", kept ? "kept" : "dropped"}}).Increment();
}

void Metrics::SetLoadTime(const std::string& map, double seconds) {
  state_->load_times.Add({{"map", map}}).Set(seconds);
}

void Metrics::CountFailedLoad(const std::string& map) {
  state_->failed_loads.Add({{"map", map}}).Increment();
}

void Metrics::SetChecked(const std::string& map, std::size_t num_places) {
  state_->checked_places.Add({{"map", map}}).Set(static_cast<double>(num_places));
}

void Metrics::CountDamaged(const std::string& map) {
  state_->damaged_maps.Add({{"map", map}}).Increment();
}

void Metrics::StartCountingLoads(const std::string& map) {
  state_->failed_loads.Add({{"map", map}});
  state_->damaged_maps.Add({{"map", map}});
}

void Metrics::StartCountingTlsReloads() { state_->failed_tls_reloads.Add({}); }

void Metrics::CountFrontMadeAnew(const std::string& reason) {
  state_->fronts_made_anew.Add({{"reason", reason}}).Increment();
}

void Metrics::CountSelfCheck(bool is_answered) {
  state_->self_checks.Add({{"result", is_answered ? "answered" : "unanswered"}}).Increment();
}

void Metrics::CountFailedTlsReload() { state_->failed_tls_reloads.Add({}).Increment(); }

void Metrics::SetTlsExpiry(std::int64_t unix_s) {
  state_->tls_expiries.Add({}).Set(static_cast<double>(unix_s));
}

void Metrics::SetFileUnusable(const std::string& file, bool is_unusable) {
  state_->unusable_files.Add({{"file", file}}).Set(is_unusable ? 1.0 : 0.0);
}

std::string Metrics::Text() const {
  std::vector<prometheus::MetricFamily> families = state_->registry.Collect();
  std::ranges::move(LookedUp(state_->look()), std::back_inserter(families));
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace scanloc::server

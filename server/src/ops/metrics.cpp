#include "ops/metrics.hpp"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <utility>

#include "ops/process_metrics.hpp"
#include "scanloc/server/build_info.hpp"

namespace scanloc::server {
namespace {

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

std::string CodeName(absl::StatusCode code) { return absl::StatusCodeToString(code); }

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

/// What is not counted but looked up.
class Looked : public prometheus::Collectable {
 public:
  explicit Looked(std::function<Metrics::Gauges()> look) : look_(std::move(look)) {}

  [[nodiscard]] std::vector<prometheus::MetricFamily> Collect() const override {
    const Metrics::Gauges now = look_();
    return {
        FamilyOf("scanloc_queue_depth", "Queries that wait for a thread.", MetricType::Gauge,
                 now.num_waiting),
        FamilyOf("scanloc_in_flight", "Queries that run or wait.", MetricType::Gauge,
                 now.num_waiting + now.num_running),
        FamilyOf("scanloc_streams_open", "Robots on a stream.", MetricType::Gauge, now.num_streams),
        FamilyOf("scanloc_draining", "1 while the server is stopping.", MetricType::Gauge,
                 now.is_draining ? 1.0 : 0.0),
        MapGauge("scanloc_map_serving", "1 while the map answers.", now.maps,
                 [](const MapSummary& map) { return map.state == MapState::kServing ? 1.0 : 0.0; }),
        MapGauge("scanloc_map_generation", "How often a map was put in service by this name.",
                 now.maps,
                 [](const MapSummary& map) { return static_cast<double>(map.generation); }),
        MapGauge("scanloc_map_places", "Places of the map.", now.maps,
                 [](const MapSummary& map) { return static_cast<double>(map.num_places); }),
    };
  }

 private:
  const std::function<Metrics::Gauges()> look_;
};

}  // namespace

struct Metrics::State {
  explicit State(std::function<Gauges()> look) : looked(std::move(look)) {
    prometheus::BuildGauge()
        .Name("scanloc_build_info")
        .Help("Always 1; what is running.")
        .Register(registry)
        .Add({{"version", BuildVersion()}, {"compiler", BuildCompiler()}})
        .Set(1.0);
    // At 0 from the start, so that the first one is seen as a rise.
    for (const char* reason : {"deaf", "memory"}) fronts_made_anew.Add({{"reason", reason}});
  }

  [[nodiscard]] std::vector<prometheus::MetricFamily> Collect() const {
    std::vector<prometheus::MetricFamily> families = registry.Collect();
    for (const prometheus::Collectable* more :
         {static_cast<const prometheus::Collectable*>(&looked),
          static_cast<const prometheus::Collectable*>(&process)}) {
      for (prometheus::MetricFamily& family : more->Collect()) {
        families.push_back(std::move(family));
      }
    }
    return families;
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

  prometheus::Registry registry;
  Looked looked;
  ProcessMetrics process;
  prometheus::Family<prometheus::Counter>& calls =
      prometheus::BuildCounter()
          .Name("scanloc_requests_total")
          .Help("Requests that have ended, by method, status code, map and outcome of the answer.")
          .Register(registry);
  prometheus::Family<Histogram>& call_times =
      prometheus::BuildHistogram()
          .Name("scanloc_request_duration_seconds")
          .Help("From the arrival of a request to its answer [s].")
          .Register(registry);
  prometheus::Family<Histogram>& stages = prometheus::BuildHistogram()
                                              .Name("scanloc_stage_duration_seconds")
                                              .Help("Time of answered queries by stage [s].")
                                              .Register(registry);
  Stage queue{stages, "queue"};
  Stage decode{stages, "decode"};
  Stage describe{stages, "describe"};
  Stage retrieve{stages, "retrieve"};
  Stage match{stages, "match"};
  Stage verify{stages, "verify"};
  prometheus::Family<Histogram>& confidences =
      prometheus::BuildHistogram()
          .Name("scanloc_confidence")
          .Help("Confidence of the best candidate of answered queries, by map.")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& rejections =
      prometheus::BuildCounter()
          .Name("scanloc_rejected_total")
          .Help("Requests and streams refused before any work was done, by reason.")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& captures =
      prometheus::BuildCounter()
          .Name("scanloc_captures_total")
          .Help("Queries without a place, kept for replay or dropped because the disk was slower.")
          .Register(registry);
  prometheus::Family<prometheus::Gauge>& load_times =
      prometheus::BuildGauge()
          .Name("scanloc_map_load_seconds")
          .Help("How long the last load of the map took, its check included [s].")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& failed_loads =
      prometheus::BuildCounter()
          .Name("scanloc_map_reload_failures_total")
          .Help("Loads and reloads that failed; the map before stays in service.")
          .Register(registry);
  prometheus::Family<prometheus::Gauge>& checked_places =
      prometheus::BuildGauge()
          .Name("scanloc_map_checked_places")
          .Help("Places of the map that were found sound since it was put in service.")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& damaged_maps =
      prometheus::BuildCounter()
          .Name("scanloc_map_damaged_total")
          .Help("Times that a map was taken out of service because its file is damaged.")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& fronts_made_anew =
      prometheus::BuildCounter()
          .Name("scanloc_front_rebuilds_total")
          .Help(
              "Times that all connections were ended because the server did not answer itself or "
              "clients made it hold too much memory, by reason.")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& self_checks =
      prometheus::BuildCounter()
          .Name("scanloc_self_checks_total")
          .Help("Health checks of the server by itself, as a client, by result.")
          .Register(registry);
  prometheus::Family<prometheus::Counter>& failed_tls_reloads =
      prometheus::BuildCounter()
          .Name("scanloc_tls_reload_failures_total")
          .Help("Changes of the TLS files that were of no use; those before stay in force.")
          .Register(registry);
  prometheus::Family<prometheus::Gauge>& tls_expiries =
      prometheus::BuildGauge()
          .Name("scanloc_tls_expiry_seconds")
          .Help("When the certificate in force expires [Unix time, s].")
          .Register(registry);
  prometheus::Family<prometheus::Gauge>& unusable_files =
      prometheus::BuildGauge()
          .Name("scanloc_file_unusable")
          .Help("1 while a file that is read again on change cannot be read, or is bad.")
          .Register(registry);
};

Metrics::Metrics(std::function<Gauges()> look) : state_(std::make_unique<State>(std::move(look))) {}
Metrics::~Metrics() = default;

void Metrics::CountCall(const std::string& method, absl::StatusCode code, const std::string& map,
                        const std::string& outcome, std::optional<double> seconds) {
  state_->calls
      .Add({{"method", method}, {"code", CodeName(code)}, {"map", map}, {"outcome", outcome}})
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
  return prometheus::TextSerializer().Serialize(state_->Collect());
}

}  // namespace scanloc::server

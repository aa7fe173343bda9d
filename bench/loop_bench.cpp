// Loop closure while the map grows, beside a search of the same map that stands still.

#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "scanloc/core/localizer.hpp"
#include "scanloc/core/loop_detector.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/bench_map.hpp"

namespace scanloc {
namespace {

constexpr std::int64_t kStep_ns = 100'000'000;  // 10 Hz

std::shared_ptr<const Map> LargeMap() {
  static const auto map =
      std::make_shared<const Map>(mapdb::LoadMap(bench::LargeMap().path).value());
  return map;
}

Context ContextOf(const ContextTable& table, std::size_t entry) {
  const ContextView view = table.context(entry);
  return {view.num_rows, view.num_cols, {view.cells_cm.begin(), view.cells_cm.end()}};
}

/// What the large map was built of.
PlaceDescriptor DescriptorOf(const Map& map, std::size_t place) {
  const std::size_t num_polar = map.polar.size() / map.places.size();
  const std::size_t num_cart = map.cart.size() / map.places.size();
  PlaceDescriptor descriptor;
  for (std::size_t v = 0; v < num_polar; ++v) {
    descriptor.polar.push_back(ContextOf(map.polar, place * num_polar + v));
  }
  descriptor.cart = ContextOf(map.cart, place * num_cart);
  descriptor.structure = map.structures[place];
  descriptor.num_voxels = 1000;
  return descriptor;
}

/// A detector that is driven along the large map, over and over.
class Robot {
 public:
  explicit Robot(const char* method, int num_candidates)
      : detector_(LoopDetector::Create(
                      {.query = {.method = *ParseMethod(method), .num_candidates = num_candidates}})
                      .value()) {
    nothing_ = Describer::Create(detector_.params())->Describe({});
  }

  void Add(PlaceDescriptor descriptor) {
    const auto& places = LargeMap()->places;
    const Pose& pose = places[detector_.num_places() % places.size()].T_map_place;
    benchmark::DoNotOptimize(
        detector_.Add(std::move(descriptor), now_ns_ += kStep_ns, pose).value());
  }
  void Query(const ScanDescriptor& scan) {
    benchmark::DoNotOptimize(detector_.Query(scan, now_ns_).value());
  }
  /// Takes in what was added, and asks nothing.
  void Grow() { Query(nothing_); }

 private:
  LoopDetector detector_;
  ScanDescriptor nothing_;
  std::int64_t now_ns_ = 0;
};

void PlainSearch(benchmark::State& state, const char* method, int num_candidates) {
  static const auto localizer = *Localizer::Create(LargeMap());
  const auto& queries = bench::LargeMap().queries;
  const Query query{.method = *ParseMethod(method), .num_candidates = num_candidates};
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(*localizer->Localize(queries[i++ % queries.size()], query));
  }
}

/// At the size of the large map, each scan one place more.
void AddAndQuery(benchmark::State& state, const char* method, int num_candidates) {
  const Map& map = *LargeMap();
  Robot robot(method, num_candidates);
  for (std::size_t i = 0; i < map.places.size(); ++i) robot.Add(DescriptorOf(map, i));
  robot.Grow();
  const auto& queries = bench::LargeMap().queries;
  std::size_t i = 0;
  for (auto _ : state) {
    state.PauseTiming();
    PlaceDescriptor descriptor = DescriptorOf(map, i % map.places.size());
    state.ResumeTiming();
    robot.Add(std::move(descriptor));
    robot.Query(queries[i++ % queries.size()]);
  }
}

/// From nothing to the large map, a place at a time; the mean of an Add, all trees included.
void AddAll(benchmark::State& state, const char* method) {
  const Map& map = *LargeMap();
  for (auto _ : state) {
    state.PauseTiming();
    Robot robot(method, 1);
    std::vector<PlaceDescriptor> descriptors;
    for (std::size_t i = 0; i < map.places.size(); ++i) descriptors.push_back(DescriptorOf(map, i));
    state.ResumeTiming();
    for (PlaceDescriptor& descriptor : descriptors) {
      robot.Add(std::move(descriptor));
      robot.Grow();
    }
  }
  state.counters["s_per_add"] = benchmark::Counter(
      static_cast<double>(map.places.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK_CAPTURE(PlainSearch, auto, "auto", 100) -> Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(AddAndQuery, auto, "auto", 100) -> Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlainSearch, a_pc_k10, "a-pc", 10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(AddAndQuery, a_pc_k10, "a-pc", 10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(AddAll, auto, "auto") -> Unit(benchmark::kMillisecond) -> Iterations(1);
BENCHMARK_CAPTURE(AddAll, a_pc, "a-pc")->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();

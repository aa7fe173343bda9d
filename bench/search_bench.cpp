// Loading a large map, and searching it: the three stages beside brute force.

#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "scan_context/key_batches.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/bench_map.hpp"

namespace scanloc {
namespace {

std::shared_ptr<const Localizer> Load(const std::string& path) {
  return *Localizer::Create(std::make_shared<const Map>(mapdb::LoadMap(path).value()));
}

const Localizer& LargeLocalizer() {
  static const std::shared_ptr<const Localizer> localizer = Load(bench::LargeMap().path);
  return *localizer;
}

void LoadMapAndBuildTrees(benchmark::State& state) {
  const std::string& path = bench::LargeMap().path;
  for (auto _ : state) benchmark::DoNotOptimize(Load(path));
  state.counters["places"] = static_cast<double>(bench::NumPlaces());
}
BENCHMARK(LoadMapAndBuildTrees)->Unit(benchmark::kMillisecond);

void Search(benchmark::State& state, const char* method, int num_candidates) {
  const Localizer& localizer = LargeLocalizer();
  const auto& queries = bench::LargeMap().queries;
  const Query query{.method = *ParseMethod(method), .num_candidates = num_candidates};
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(*localizer.Localize(queries[i++ % queries.size()], query));
  }
}
BENCHMARK_CAPTURE(Search, a_pc_k1, "a-pc", 1)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Search, a_pc_k10, "a-pc", 10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Search, a_cc_k10, "a-cc", 10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Search, a_pc_k100, "a-pc", 100)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Search, auto_k100, "auto", 100)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Search, a_pc_brute, "a-pc-brute", 10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Search, a_pc_naive_brute, "a-pc-naive-brute", 10)
    ->Unit(benchmark::kMicrosecond)
    ->Iterations(3);

/// 60,000 keys of 20 components, compared to one: what a kernel of KeyBatches takes of a search.
void ScanKeys(benchmark::State& state, key_batches::Kernel kernel) {
  constexpr std::size_t kNumBatches = 60'000 / KeyBatches::kNumLanes;
  constexpr std::size_t kNumPairs = 12;
  std::mt19937_64 random(1);
  std::uniform_int_distribution<int> component(-3000, 3000);
  std::vector<std::int16_t> keys(kNumBatches * kNumPairs * 2 * KeyBatches::kNumLanes);
  std::vector<std::int16_t> query(kNumPairs * 2);
  for (std::int16_t& c : keys) c = static_cast<std::int16_t>(component(random));
  for (std::int16_t& c : query) c = static_cast<std::int16_t>(component(random));
  constexpr std::int32_t kNearer = 60'000'000;  // than some of a thousand
  for (auto _ : state) {
    std::uint32_t near = 0;
    KeyBatches::Sums sums;
    for (std::size_t batch = 0; batch < kNumBatches; ++batch) {
      near |= kernel(keys.data() + batch * kNumPairs * 2 * KeyBatches::kNumLanes, query.data(),
                     kNumPairs, kNearer, sums.data());
    }
    benchmark::DoNotOptimize(near);
  }
}

const bool kAreKernelsRegistered = [] {
  for (const key_batches::NamedKernel& k : key_batches::Kernels()) {
    benchmark::RegisterBenchmark((std::string("ScanKeys/") + k.name).c_str(), ScanKeys, k.kernel)
        ->Unit(benchmark::kMicrosecond);
  }
  return true;
}();

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();

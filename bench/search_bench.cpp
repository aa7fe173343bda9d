// Loading a large map, and searching it: the three stages beside brute force.

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include "scanloc/core/localizer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/bench_map.hpp"

namespace scanloc {
namespace {

std::shared_ptr<const Localizer> Load(const std::string& path) {
  auto map = mapdb::LoadMap(path);
  if (!map.ok()) {
    std::cerr << map.status() << "\n";
    std::exit(1);
  }
  return *Localizer::Create(std::make_shared<const Map>(*std::move(map)));
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
  QueryOptions options;
  options.method = *ParseMethod(method);
  options.num_candidates = num_candidates;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(*localizer.Localize(queries[i++ % queries.size()], options));
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

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();

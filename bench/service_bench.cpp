// Queries over loopback, beside the same work done in place and the shortest call there is.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <vector>

#include "scanloc/client/client.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/server/server.hpp"
#include "support/bench_map.hpp"
#include "support/bench_scans.hpp"

namespace scanloc {
namespace {

constexpr int kNumCandidates = 10;

/// One server and client for all benchmarks, over the large map that search_bench uses.
struct World {
  World() {
    server::ServerOptions options;
    options.maps = {{.name = "bench", .path = bench::LargeMap().path}};
    options.listen = "127.0.0.1:0";
    const auto load = [](const std::string& path, const Map*) { return mapdb::LoadMap(path); };
    server = server::Server::Start(options, load).value();
    if (auto status = server->LoadMaps(); !status.ok()) throw std::runtime_error(status.ToString());
    client = std::make_unique<client::Client>(
        client::Client::Connect({.address = server->address()}).value());
    localizer = server->maps().Find("bench").value()->localizer;
    request.query.num_candidates = kNumCandidates;
    for (const ScanDescriptor& query : bench::LargeMap().queries) {
      descriptors.push_back({DescriptorSignature(bench::LargeMap().params), query});
    }
  }

  static World& Get() {
    static World world;
    return world;
  }

  std::unique_ptr<server::Server> server;
  std::unique_ptr<client::Client> client;
  std::shared_ptr<const Localizer> localizer;
  client::RequestOptions request;
  std::vector<SignedDescriptor> descriptors;
  std::vector<PointCloud> scans = bench::FullScans();
  Describer describer = Describer::Create(bench::LargeMap().params).value();
};

/// Runs call(i) for iteration i and tells the median and the 99th percentile of single calls.
template <typename Call>
void MeasureCalls(benchmark::State& state, Call&& call) {
  std::vector<double> times_ms;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    const absl::Status status = call(times_ms.size());
    times_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
    if (!status.ok()) {
      state.SkipWithError(status.ToString().c_str());
      return;
    }
  }
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p50_ms"] = times_ms[times_ms.size() / 2];
  state.counters["p99_ms"] = times_ms[times_ms.size() * 99 / 100];
}

void ShortestCall(benchmark::State& state) {
  World& world = World::Get();
  MeasureCalls(state, [&](std::size_t) { return world.client->ListMaps().status(); });
}
BENCHMARK(ShortestCall)->UseRealTime()->Unit(benchmark::kMillisecond);

void DescriptorInPlace(benchmark::State& state) {
  World& world = World::Get();
  MeasureCalls(state, [&](std::size_t i) {
    const auto& query = world.descriptors[i % world.descriptors.size()];
    return world.localizer->Localize(query.descriptor, world.request.query).status();
  });
}
BENCHMARK(DescriptorInPlace)->UseRealTime()->Unit(benchmark::kMillisecond);

void DescriptorOverLoopback(benchmark::State& state) {
  World& world = World::Get();
  MeasureCalls(state, [&](std::size_t i) {
    const auto& query = world.descriptors[i % world.descriptors.size()];
    return world.client->LocalizeDescriptor(query, world.request).status();
  });
}
BENCHMARK(DescriptorOverLoopback)->UseRealTime()->Unit(benchmark::kMillisecond);

void ScanInPlace(benchmark::State& state) {
  World& world = World::Get();
  MeasureCalls(state, [&](std::size_t i) {
    const ScanDescriptor query = world.describer.Describe(world.scans[i % world.scans.size()]);
    return world.localizer->Localize(query, world.request.query).status();
  });
}
BENCHMARK(ScanInPlace)->UseRealTime()->Unit(benchmark::kMillisecond);

void ScanOverLoopback(benchmark::State& state) {
  World& world = World::Get();
  state.counters["points"] = static_cast<double>(world.scans.front().size());
  MeasureCalls(state, [&](std::size_t i) {
    const PointCloud& scan = world.scans[i % world.scans.size()];
    return world.client->LocalizeScan(scan, world.request).status();
  });
}
BENCHMARK(ScanOverLoopback)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();

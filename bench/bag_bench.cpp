// Reading the clouds of a bag, beside describing them, and beside what the libraries that compress
// need to decompress them.
//   SCANLOC_BENCH_BAG=FILE SCANLOC_BENCH_POSES=/odom bag_bench

#include <benchmark/benchmark.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc {
namespace {

// Without a bag or poses in it, the benchmark says so and ends.
std::vector<dataset::ScanFile> Clouds(benchmark::State& state, bool deskew) {
  const char* const bag = std::getenv("SCANLOC_BENCH_BAG");
  const char* const poses = std::getenv("SCANLOC_BENCH_POSES");
  std::vector<std::string> notes;
  const auto clouds = dataset::ListBagScans({.paths = {bag == nullptr ? "" : bag},
                                             .poses_from = poses == nullptr ? "" : poses,
                                             .deskew = deskew},
                                            notes);
  if (clouds.ok()) return *clouds;
  state.SkipWithError(std::string(clouds.status().message()).c_str());
  return {};
}

// Opening looks at all checksums and at the heads of all clouds.
void OpenBag(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(Clouds(state, false).data());
}

void Read(benchmark::State& state, bool deskew) {
  const std::vector<dataset::ScanFile> clouds = Clouds(state, deskew);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(dataset::ReadScan(clouds[i++ % clouds.size()]).value().points.data());
  }
}

void ReadClouds(benchmark::State& state) { Read(state, false); }
void ReadCloudsAndTakeMotionOut(benchmark::State& state) { Read(state, true); }

void DescribeClouds(benchmark::State& state) {
  Describer describer = Describer::Create(Params()).value();
  std::vector<PointCloud> scans;
  for (const dataset::ScanFile& cloud : Clouds(state, false)) {
    if (scans.size() == 10) break;
    scans.push_back(dataset::ReadScan(cloud).value().points);
  }
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(describer.Describe(scans[i++ % scans.size()]));
}

/// The messages of some clouds as they are in the bag; none where Clouds has none.
std::vector<std::string> Messages(benchmark::State& state) {
  std::vector<std::string> messages;
  if (Clouds(state, false).empty()) return messages;
  const auto bag = dataset::Bag::Open({std::getenv("SCANLOC_BENCH_BAG")}).value();
  std::vector<const dataset::BagTopic*> clouds;
  for (const dataset::BagTopic& topic : bag->topics()) {
    if (topic.type == "sensor_msgs/PointCloud2") clouds.push_back(&topic);
  }
  for (const std::size_t i : bag->Messages(clouds)) {
    if (messages.size() == 10) break;
    const absl::Status read = bag->Read(i, [&](const dataset::BagMessage& message) {
      messages.emplace_back(message.bytes);
      return absl::OkStatus();
    });
    if (!read.ok()) std::abort();
  }
  return messages;
}

void DecompressZstd(benchmark::State& state) {
  const std::vector<std::string> messages = Messages(state);
  if (messages.empty()) return;
  std::vector<std::string> compressed;
  for (const std::string& message : messages) {
    std::string& bytes = compressed.emplace_back(ZSTD_compressBound(message.size()), '\0');
    bytes.resize(ZSTD_compress(bytes.data(), bytes.size(), message.data(), message.size(), 3));
  }
  std::string out(messages.front().size() * 2, '\0');
  std::size_t i = 0;
  for (auto _ : state) {
    const std::string& bytes = compressed[i++ % compressed.size()];
    benchmark::DoNotOptimize(ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size()));
  }
}

void DecompressLz4(benchmark::State& state) {
  const std::vector<std::string> messages = Messages(state);
  if (messages.empty()) return;
  std::vector<std::string> compressed;
  for (const std::string& message : messages) {
    std::string& bytes =
        compressed.emplace_back(LZ4F_compressFrameBound(message.size(), nullptr), '\0');
    bytes.resize(
        LZ4F_compressFrame(bytes.data(), bytes.size(), message.data(), message.size(), nullptr));
  }
  std::string out(messages.front().size() * 2, '\0');
  LZ4F_dctx* context = nullptr;
  LZ4F_createDecompressionContext(&context, LZ4F_VERSION);
  std::size_t i = 0;
  for (auto _ : state) {
    const std::string& bytes = compressed[i++ % compressed.size()];
    std::size_t num_out = out.size();
    std::size_t num_in = bytes.size();
    benchmark::DoNotOptimize(
        LZ4F_decompress(context, out.data(), &num_out, bytes.data(), &num_in, nullptr));
  }
  LZ4F_freeDecompressionContext(context);
}

BENCHMARK(OpenBag)->Unit(benchmark::kMicrosecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(ReadClouds)->Unit(benchmark::kMicrosecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(ReadCloudsAndTakeMotionOut)->Unit(benchmark::kMicrosecond);
BENCHMARK(DescribeClouds)->Unit(benchmark::kMicrosecond);
BENCHMARK(DecompressZstd)->Unit(benchmark::kMicrosecond);
BENCHMARK(DecompressLz4)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace scanloc

BENCHMARK_MAIN();

// What a map of some size takes: to open, in memory, and a query of it with `auto`. One line of
// CSV. Beside the time that passes stands the processor's (cpu), which other work on the machine
// changes less; that of stages is the processor's.
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "structural/signature_index.hpp"
#include "support/made_road.hpp"

namespace scanloc::bench {
namespace {

/// Of all threads of the process.
std::int64_t CpuNowNs() {
  timespec now = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}

/// Since it was made.
class Stopwatch {
 public:
  [[nodiscard]] double Passed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  [[nodiscard]] double Cpu_s() const {
    return 1e-9 * static_cast<double>(CpuNowNs() - cpu_start_ns_);
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::int64_t cpu_start_ns_ = CpuNowNs();
};

/// Of /proc/self/status [MB].
double MemoryMb(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(field + ":")) return std::stod(line.substr(field.size() + 1)) * 1.024e-3;
  }
  return 0.0;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

struct Options {
  std::string map;
  bool is_whole = false;
  std::int64_t cache_bytes = std::int64_t{256} << 20;
  std::size_t num_queries = 200;
  double road_m = 20'000.0;  // queries are of this much of the road, whatever the map's size
  std::uint64_t seed = 1;
  std::size_t num_keys = 0;
};

/// Queries of a later visit; how long each takes, and whether it is right.
int MeasureMap(const Options& options) {
  const Stopwatch start;
  absl::StatusOr<Map> map =
      options.is_whole
          ? mapdb::LoadMap(options.map)
          : mapdb::OpenMap(options.map, {.cache = mapdb::MakePayloadCache(options.cache_bytes)});
  if (!map.ok()) {
    std::cerr << map.status() << "\n";
    return 1;
  }
  const double open_s = start.Passed_s();
  const std::size_t num_places = map->places.size();
  const auto localizer = Localizer::Create(
      std::make_shared<const Map>(*std::move(map)),
      [](std::span<const std::function<void()>> tasks) { return RunTasks(NumThreads(0), tasks); });
  if (!localizer.ok()) {
    std::cerr << localizer.status() << "\n";
    return 1;
  }
  const double ready_s = start.Passed_s();
  const MadeRoad road(options.seed);
  Describer describer = *Describer::Create((*localizer)->map().params);
  std::vector<double> whole_ms, cpu_ms, retrieve_ms, match_ms;
  double first_s = 0.0, first_cpu_s = 0.0;
  int num_localized = 0, num_right = 0, num_false = 0, num_first_right = 0;
  for (std::size_t q = 0; q < options.num_queries; ++q) {
    const double along_m = (static_cast<double>(q) + 0.37) /
                           static_cast<double>(options.num_queries) *
                           std::min(options.road_m, static_cast<double>(num_places));
    const MadeRoad::Visit visit{along_m, q % 3 == 0 ? -1.5 : 0.8, q % 2 == 1, 2};
    const ScanDescriptor scan = describer.Describe(road.Scan(visit));
    const Stopwatch asked;
    SearchControl control = TimedBy(CpuNowNs);
    control.run_both = &RunBoth;
    const auto answer = (*localizer)->Localize(scan, {}, control);
    whole_ms.push_back(1e3 * asked.Passed_s());
    cpu_ms.push_back(1e3 * asked.Cpu_s());
    if (q == 0) first_s = start.Passed_s();
    if (q == 0) first_cpu_s = start.Cpu_s();
    if (!answer.ok()) {
      std::cerr << answer.status() << "\n";
      return 1;
    }
    retrieve_ms.push_back(1e-6 * static_cast<double>(answer->times.retrieve_ns));
    match_ms.push_back(1e-6 * static_cast<double>(answer->times.match_ns));
    const Pose truth = road.PoseAt(visit.along_m, visit.left_m, visit.reverse);
    const bool is_right =
        !answer->candidates.empty() && !MissOf(DifferenceOf(answer->candidates.front().T_map_query,
                                                            truth, Eigen::Vector3d::UnitZ()))
                                            .any();
    num_first_right += is_right ? 1 : 0;
    if (answer->outcome != Outcome::kLocalized) continue;
    ++num_localized;
    ++(is_right ? num_right : num_false);
  }
  std::cout
      << "places,file_mb,open_s,ready_s,first_answer_s,first_answer_cpu_s,rss_mb,peak_mb,"
         "p50_ms,p99_ms,cpu_p50_ms,cpu_p99_ms,retrieve_p50_ms,match_p50_ms,queries,first_right,"
         "localized_right,false\n"
      << absl::StrFormat(
             "%d,%.1f,%.2f,%.2f,%.2f,%.2f,%.0f,%.0f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%d,%d,%d,%d\n",
             num_places, 1e-6 * static_cast<double>(std::filesystem::file_size(options.map)),
             open_s, ready_s, first_s, first_cpu_s, MemoryMb("VmRSS"), MemoryMb("VmHWM"),
             Quantile(whole_ms, 0.5), Quantile(whole_ms, 0.99), Quantile(cpu_ms, 0.5),
             Quantile(cpu_ms, 0.99), Quantile(retrieve_ms, 0.5), Quantile(match_ms, 0.5),
             options.num_queries, num_first_right, num_right, num_false);
  return 0;
}

/// Keys and bearings alone of a map many times as large: each stretch of places a mixture of two
/// stretches of the one given, so that they fill what real ones fill and change along the road.
Map MixedMap(const Map& from, std::size_t num_places) {
  constexpr std::size_t kStretch = 64;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> share(0.0, 0.5);
  Map map = MakeEmptyMap(from.params);
  const auto append = [](const ContextTable& known, std::size_t a, std::size_t b, double of_b,
                         std::int32_t place, std::size_t num_places_known, ContextTable& table) {
    const std::size_t num_each = known.size() / num_places_known;
    for (std::size_t v = 0; v < (known.has_flips() ? 1 : num_each); ++v) {
      std::vector<std::int32_t> key = known.retrieval_key_cm(a * num_each + v);
      const std::vector<std::int32_t> other = known.retrieval_key_cm(b * num_each + v);
      for (std::size_t i = 0; i < key.size(); ++i) {
        key[i] = static_cast<std::int32_t>((1.0 - of_b) * key[i] + of_b * other[i]);
      }
      ContextTable::Entry entry = known.entry(a * num_each + v);
      entry.place = place;
      table.AppendKey(entry, key);
      if (known.has_flips()) table.AppendFlipOfLast();
    }
  };
  const std::size_t num_known = from.places.size();
  std::size_t a = 0;
  std::size_t b = 0;
  double of_b = 0.0;
  std::uint64_t rings_of_b = 0;
  for (std::size_t place = 0; place < num_places; ++place) {
    if (place % kStretch == 0) {
      a = random() % (num_known - kStretch);
      b = random() % (num_known - kStretch);
      of_b = share(random);
      rings_of_b = random() & random();
    }
    const std::size_t from_a = a + place % kStretch;
    const std::size_t from_b = b + place % kStretch;
    const auto number = static_cast<std::int32_t>(place);
    append(from.polar, from_a, from_b, of_b, number, num_known, map.polar);
    append(from.cart, from_a, from_b, of_b, number, num_known, map.cart);
    BearingGrid::Rings rings = from.bearings[from_a].rings();
    for (std::size_t ring = 0; ring < rings.size(); ++ring) {
      if ((rings_of_b >> ring & 1U) != 0) rings[ring] = from.bearings[from_b].rings()[ring];
    }
    map.bearings.push_back(BearingGrid(rings));
  }
  return map;
}

int MeasureKeys(const Options& options) {
  const auto known = mapdb::OpenMap(options.map);
  if (!known.ok()) {
    std::cerr << known.status() << "\n";
    return 1;
  }
  const double before_mb = MemoryMb("VmRSS");
  const Map map = MixedMap(*known, options.num_keys);
  const double tables_mb = MemoryMb("VmRSS") - before_mb;
  const Stopwatch start;
  const SignatureIndex index(map, nullptr);
  const double build_s = start.Cpu_s();
  const MadeRoad road(options.seed);
  Describer describer = *Describer::Create(map.params);
  const ShortlistParams& shortlist = map.params.automatic.shortlist;
  const std::size_t k = NumToFind(shortlist, options.num_keys);
  // With a reason to pass over some, all others are compared.
  const std::vector<bool> none(options.num_keys);
  std::vector<double> quick_ms, exact_ms;
  std::size_t num_found = 0;
  for (std::size_t q = 0; q < options.num_queries; ++q) {
    const ScanDescriptor scan =
        describer.Describe(road.Scan({100.0 * static_cast<double>(q) + 37.0, 0.8, q % 2 == 1, 2}));
    const SignatureQuery query =
        index.QueryOf(SpotsOf(scan.structure.posts, shortlist), scan.polar, scan.cart);
    const auto find = [&](const std::vector<bool>* excluded, std::vector<double>& times_ms) {
      const Stopwatch asked;
      const auto found = index.MostAlike(query, k, {.excluded = excluded});
      times_ms.push_back(1e3 * asked.Cpu_s());
      std::set<std::int32_t> places;
      for (const auto& [place, spot] : found) places.insert(place);
      return places;
    };
    const std::set<std::int32_t> nearest = find(&none, exact_ms);
    for (const std::int32_t place : find(nullptr, quick_ms)) num_found += nearest.contains(place);
  }
  std::cout << "places,tables_mb,keys_mb,peak_mb,build_cpu_s,retrieve_cpu_p50_ms,"
               "retrieve_cpu_p99_ms,exact_cpu_p50_ms,exact_cpu_p99_ms,share_of_exact\n"
            << absl::StrFormat(
                   "%d,%.0f,%.0f,%.0f,%.1f,%.2f,%.2f,%.2f,%.2f,%.3f\n", options.num_keys, tables_mb,
                   MemoryMb("VmRSS") - before_mb, MemoryMb("VmHWM"), build_s,
                   Quantile(quick_ms, 0.5), Quantile(quick_ms, 0.99), Quantile(exact_ms, 0.5),
                   Quantile(exact_ms, 0.99),
                   static_cast<double>(num_found) /
                       static_cast<double>(std::max<std::size_t>(1, k * options.num_queries)));
  return 0;
}

}  // namespace
}  // namespace scanloc::bench

int main(int argc, char** argv) {
  scanloc::bench::Options options;
  CLI::App app("Measures what a map made by make_map takes, and prints a line of CSV.");
  app.add_option("MAP", options.map, "map file")->required();
  app.add_flag("--whole", options.is_whole, "read the map into memory as a whole");
  app.add_option("--cache-bytes", options.cache_bytes, "of what was read last");
  app.add_option("--num-queries", options.num_queries, "queries")->capture_default_str();
  app.add_option("--road-m", options.road_m, "part of the road that they are of [m]");
  app.add_option("--seed", options.seed, "of the road, as of make_map");
  app.add_option("--keys", options.num_keys,
                 "measure retrieval alone, of so many places with keys like the map's");
  CLI11_PARSE(app, argc, argv);
  return options.num_keys > 0 ? scanloc::bench::MeasureKeys(options)
                              : scanloc::bench::MeasureMap(options);
}

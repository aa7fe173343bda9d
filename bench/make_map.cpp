// Writes a map of any size of a made road, without ray casting, and queries of another session.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "absl/strings/str_format.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "support/made_road.hpp"

namespace scanloc::bench {
namespace {

struct Options {
  std::string out;
  std::string session = "drive";
  std::size_t num_places = 20'000;
  double first_m = 0.0;
  double spacing_m = 1.0;
  std::uint64_t seed = 1;
  int num_threads = 0;
  bool append = false;
  std::string queries;
  std::size_t num_queries = 200;
};

absl::Status WriteMap(const MadeRoad& road, const Options& options) {
  mapdb::SessionPlan plan{.name = options.session, .scans = {}};
  const auto along_m = [&](std::size_t i) {
    return options.first_m + options.spacing_m * static_cast<double>(i);
  };
  for (std::size_t i = 0; i < options.num_places; ++i) {
    plan.scans.push_back({absl::StrFormat("%08d", i), static_cast<std::int64_t>(i) * 100'000'000,
                          road.PoseAt(along_m(i))});
  }
  mapdb::BuildOptions build;
  build.path = options.out;
  build.mode = options.append ? mapdb::BuildMode::kAppend : mapdb::BuildMode::kCreate;
  build.num_threads = options.num_threads;
  build.commit_interval = 5000;
  return mapdb::BuildMap(
             build, plan,
             [&](std::size_t i) -> absl::StatusOr<PointCloud> {
               return road.Scan({.along_m = along_m(i)});
             },
             [&](const mapdb::BuildProgress& progress) {
               if (progress.num_done % 50'000 == 0) {
                 std::fprintf(stderr, "%zu of %zu places\n", progress.num_done, progress.num_scans);
               }
             })
      .status();
}

/// In the layout of KITTI: velodyne/*.bin and poses.txt.
absl::Status WriteQueries(const MadeRoad& road, const Options& options) {
  std::filesystem::create_directories(options.queries + "/velodyne");
  std::ofstream poses(options.queries + "/poses.txt");
  for (std::size_t q = 0; q < options.num_queries; ++q) {
    const double share = (static_cast<double>(q) + 0.37) / static_cast<double>(options.num_queries);
    const MadeRoad::Visit visit{
        .along_m =
            options.first_m + share * options.spacing_m * static_cast<double>(options.num_places),
        .left_m = q % 3 == 0 ? -1.5 : 0.8,
        .reverse = q % 2 == 1,
        .session = 2};
    std::ofstream scan(options.queries + absl::StrFormat("/velodyne/%06d.bin", q),
                       std::ios::binary);
    for (const Point& point : road.Scan(visit)) {
      const float values[] = {point.x, point.y, point.z, 0.0F};
      scan.write(reinterpret_cast<const char*>(values), sizeof(values));
    }
    const Pose pose = road.PoseAt(visit.along_m, visit.left_m, visit.reverse);
    for (int i = 0; i < 12; ++i) {
      poses << absl::StrFormat("%.9f%c", pose.matrix()(i / 4, i % 4), i == 11 ? '\n' : ' ');
    }
    if (!scan || !poses) return absl::ResourceExhaustedError("cannot write " + options.queries);
  }
  return absl::OkStatus();
}

absl::Status Run(const Options& options) {
  const MadeRoad road(options.seed);
  if (!options.out.empty()) {
    RETURN_IF_ERROR(WriteMap(road, options));
  }
  return options.queries.empty() ? absl::OkStatus() : WriteQueries(road, options);
}

}  // namespace
}  // namespace scanloc::bench

int main(int argc, char** argv) {
  scanloc::bench::Options options;
  CLI::App app("Writes a map of a made road, and queries of it, for measurements of size.");
  app.add_option("--map", options.out, "map file to write; none if not given");
  app.add_option("--places", options.num_places, "places of the map")->capture_default_str();
  app.add_option("--first", options.first_m, "where on the road it begins [m]");
  app.add_option("--spacing-m", options.spacing_m, "from place to place")->capture_default_str();
  app.add_option("--seed", options.seed, "of the road")->capture_default_str();
  app.add_option("--session", options.session, "name of the session")->capture_default_str();
  app.add_option("--threads", options.num_threads, "that describe; 0: one a core");
  app.add_flag("--append", options.append, "append a session to the map");
  app.add_option("--queries", options.queries, "folder for scans and poses of a later visit");
  app.add_option("--num-queries", options.num_queries, "how many, all along the map");
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = scanloc::bench::Run(options);
  if (!status.ok()) std::cerr << status << "\n";
  return status.ok() ? 0 : 1;
}

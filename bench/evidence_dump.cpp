// What speaks for the best answer to each query of some drives, as CSV: what
// scripts/fit_evidence.py fits the confidence to, and the confidence as it is. Spots, best first:
// right, on another floor, usual (each 0 or 1) and score, between colons.
//   evidence_dump SETS > answers.csv
// SETS: lines of KIND MAP_DRIVE QUERY_DRIVE within|elsewhere SENSOR_HEIGHT_M SCALE; a drive is a
// folder with scans and poses.txt, or FOLDER:FROM:TO:STEP for some of them. Queries from elsewhere
// are never right.
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "absl/strings/str_format.h"
#include "scanloc/core/map/up.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "structural/auto_search.hpp"
#include "support/drive_part.hpp"

namespace scanloc {
namespace {

using bench::Fail;
using bench::Frames;
using bench::Get;

void Dump(const std::string& kind, const std::string& map_drive, const std::string& query_drive,
          bool is_within, double sensor_height_m, double scale) {
  Params params;
  params.automatic = AutoParamsAtScale(scale);
  params.sensor_height_m = sensor_height_m;
  Map map = MakeEmptyMap(params);
  map.sessions = {"only"};
  Describer describer = Get(Describer::Create(params));
  for (const dataset::Frame& frame : Frames(map_drive)) {
    map.AppendDescriptor(static_cast<std::int32_t>(map.places.size()),
                         describer.DescribePlace(Get(dataset::ReadScan(frame.file())).points));
    map.places.push_back({frame.T_map_sensor, 0, 0});
  }
  const AutoSearch search(map, Get(FindUp(map)));
  for (const dataset::Frame& frame : Frames(query_drive)) {
    const ScanDescriptor query = describer.Describe(Get(dataset::ReadScan(frame.file())).points);
    if (!ShowsEnough(query.structure.posts, params.automatic)) continue;
    StageTimes times;
    const std::vector<Spot> spots = Get(search.Find(query, {}, {}, times));
    if (spots.empty()) continue;
    const Support& support = *spots.front().support;
    std::cout << absl::StrFormat(
        "%s,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%d,%.4f,", kind, support.score, support.sharpness,
        support.over_mirror, support.contradicted, support.inliers, support.over_mirror_exactly,
        support.unseen, support.num_posts,
        ConfidencesOf(spots, params.automatic.evidence, search.up()).front());
    for (const Spot& spot : spots) {
      const bool is_right =
          is_within &&
          !MissOf(DifferenceOf(spot.T_map_query, frame.T_map_sensor, search.up())).any();
      const bool is_above = IsAbove(spots.front(), spot, search.up());
      std::cout << absl::StrFormat("%d:%d:%d:%.4f ", is_right, is_above, spot.hypothesis.is_usual,
                                   spot.score);
    }
    std::cout << '\n';
  }
}

}  // namespace
}  // namespace scanloc

int main(int argc, char** argv) {
  if (argc != 2) scanloc::bench::Fail("one argument: the file of sets");
  std::ifstream sets(argv[1]);
  std::cout << "kind,score,sharpness,over_mirror,contradicted,inliers,over_mirror_exactly,unseen,"
               "num_posts,confidence,spots\n";
  for (std::string line; std::getline(sets, line);) {
    std::istringstream words(line);
    std::string kind, map_drive, query_drive, where;
    double sensor_height_m = 0.0;
    double scale = 0.0;
    if (!(words >> kind >> map_drive >> query_drive >> where >> sensor_height_m >> scale)) {
      scanloc::bench::Fail("a line of six words was expected, not: " + line);
    }
    scanloc::Dump(kind, map_drive, query_drive, where == "within", sensor_height_m, scale);
  }
}

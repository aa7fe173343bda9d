#pragma once

#include <string>
#include <vector>

#include "scanloc/report/csv.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::test {

using Args = std::vector<std::string>;

inline const std::string kScanloc = BinDir() + "/scanloc";
inline const std::string kScanlocd = BinDir() + "/scanlocd";

/// The arguments with the program in front.
Args Command(const std::string& program, Args args);

/// Runs `scanloc` with the arguments.
ProcessResult Scanloc(const Args& args, const ProcessOptions& options = {});

/// Runs `scanloc`, which must succeed, and returns what it wrote to stdout. Throws if it fails.
std::string MustScanloc(const Args& args);

/// Throws if the text is no table.
report::CsvTable ParseCsv(const std::string& text);

/// Two sessions of one tiny town.
struct TinyTown {
  TempDir dir;
  std::string drive1;  ///< folder; its poses are drive1/poses.txt
  std::string drive2;
  std::string map1;  ///< of drive 1, session "one"

  static constexpr int kNumScans = 30;  ///< of each drive

  [[nodiscard]] std::string Poses1() const { return drive1 + "/poses.txt"; }
  [[nodiscard]] std::string Poses2() const { return drive2 + "/poses.txt"; }
};

/// Made at its first use; to be left as it is.
const TinyTown& Town();

/// `scanloc build` of drive 1 of Town() into `map`, with every scan a place.
Args BuildArgs(const std::string& map);

/// A folder whose scans are those of drive 1 of Town() over and over, so that a build of it takes a
/// while, with poses on a straight line.
struct LongDrive {
  std::string scans;
  std::string poses;
};
LongDrive MakeLongDrive(const TempDir& dir, int num_scans);

/// The content id that `scanloc info` tells.
std::string ContentId(const std::string& map);

/// How many places a map has that a build left when it was broken off: 0 if that was before its
/// first commit. Throws if the map does not open, is damaged, or claims to be whole.
int NumPlacesCommitted(const std::string& map);

/// Number of lines.
int CountLines(const std::string& text);

}  // namespace scanloc::test

#include "e2e/programs.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace scanloc::test {

Args Command(const std::string& program, Args args) {
  args.insert(args.begin(), program);
  return args;
}

ProcessResult Scanloc(const Args& args, const ProcessOptions& options) {
  return RunProcess(Command(kScanloc, args), options);
}

std::string MustScanloc(const Args& args) {
  const ProcessResult result = Scanloc(args);
  if (result.status == 0) return result.out;
  std::string command = "scanloc";
  for (const std::string& arg : args) command += " " + arg;
  throw std::runtime_error(command + " ended with " + std::to_string(result.status) + ": " +
                           result.err);
}

const TinyTown& Town() {
  static const std::unique_ptr<const TinyTown> town = [] {
    auto made = std::make_unique<TinyTown>();
    made->drive1 = made->dir.File("drive1");
    made->drive2 = made->dir.File("drive2");
    made->map1 = made->dir.File("one.scanloc");
    const Args scene = {"--town-seed", "3",   "--length-m",  "60", "--rays", "16",
                        "--azimuths",  "360", "--spacing-m", "2",  "--quiet"};
    Args first = {"simulate", made->drive1, "--session-seed", "1"};
    Args second = {"simulate", made->drive2, "--session-seed", "2", "--lane-shift-m", "1"};
    first.insert(first.end(), scene.begin(), scene.end());
    second.insert(second.end(), scene.begin(), scene.end());
    MustScanloc(first);
    MustScanloc(second);
    MustScanloc({"build", made->map1, "--scans", made->drive1, "--poses", made->Poses1(),
                 "--session", "one", "--spacing-m", "0", "--quiet"});
    return made;
  }();
  return *town;
}

Args BuildArgs(const std::string& map) {
  return {"build",     map,   "--scans",     Town().drive1, "--poses", Town().Poses1(),
          "--session", "one", "--spacing-m", "0",           "--quiet"};
}

LongDrive MakeLongDrive(const TempDir& dir, int num_scans) {
  namespace fs = std::filesystem;
  std::string poses;
  fs::create_directories(dir.File("long"));
  for (int i = 0; i < num_scans; ++i) {
    std::string name = std::to_string(i);
    name = std::string(6 - name.size(), '0') + name + ".bin";
    std::string source = std::to_string(i % TinyTown::kNumScans);
    source = std::string(6 - source.size(), '0') + source + ".bin";
    fs::create_symlink(fs::path(Town().drive1) / "velodyne" / source, dir.File("long/" + name));
    poses += "1 0 0 " + std::to_string(2 * i) + " 0 1 0 0 0 0 1 0\n";
  }
  return {dir.File("long"), dir.Write("long.txt", poses)};
}

std::string ContentId(const std::string& map) {
  return nlohmann::json::parse(MustScanloc({"info", map, "--json"})).at("content_id");
}

int NumPlacesCommitted(const std::string& map) {
  if (!std::filesystem::exists(map)) return 0;
  const ProcessResult verified = Scanloc({"verify", map, "--recover"});
  // As which it is known for certain only once what was left unfinished has been undone.
  const bool is_empty = verified.err.find("stopped before the first commit") != std::string::npos;
  if (verified.status == 1 && is_empty) return 0;
  if (verified.status != 0) throw std::runtime_error(verified.err);
  const auto info = nlohmann::json::parse(MustScanloc({"info", map, "--json"}));
  if (info.at("complete") != false) throw std::runtime_error(map + " claims to be whole");
  return info.at("num_places");
}

int CountLines(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

report::CsvTable ParseCsv(const std::string& text) {
  const auto table = report::CsvTable::Parse(text);
  if (!table.ok()) throw std::runtime_error(table.status().ToString() + "\n" + text);
  return *table;
}

}  // namespace scanloc::test

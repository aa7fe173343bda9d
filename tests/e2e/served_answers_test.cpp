// A real server: what it answers is what the map file answers.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"

namespace scanloc::test {
namespace {

/// scanlocd on a free port.
class RunningServer {
 public:
  /// Arguments of --map, NAME=FILE.
  explicit RunningServer(const Args& maps, const Args& more = {})
      : process_(ServerCommand(maps, more)) {
    const std::string line = process_.ReadLineWith("scanlocd ready on ");
    address_ = line.substr(line.rfind(' ') + 1);
  }

  [[nodiscard]] const std::string& address() const { return address_; }

  /// Its exit status.
  int Stop() {
    process_.Signal(SIGTERM);
    return process_.Wait();
  }

 private:
  static Args ServerCommand(const Args& maps, const Args& more) {
    Args args = {kScanlocd, "--listen", "127.0.0.1:0"};
    args.insert(args.end(), more.begin(), more.end());
    for (const std::string& map : maps) args.insert(args.end(), {"--map", map});
    return args;
  }

  Process process_;
  std::string address_;
};

Args LocateArgs(const Args& where, const Args& more) {
  Args args = {"locate", "--scans", Town().drive2, "--quiet"};
  args.insert(args.end(), where.begin(), where.end());
  args.insert(args.end(), more.begin(), more.end());
  return args;
}

TEST(ServedAnswers, AreThoseOfTheMapFileByteForByte) {
  const TempDir dir;
  const std::string map = dir.File("on-earth");
  MustScanloc({"edit", Town().map1, map, "--geo-origin", "48.1,11.5,519,30", "--quiet"});
  RunningServer server({"one=" + map});
  for (const char* method : {"auto", "pc", "cc", "a-pc", "a-cc"}) {
    for (const char* form : {"--csv=-", "--json"}) {
      const Args what = {"--method", method, form, "--top", "3", "--truth", Town().Poses2()};
      const std::string local = MustScanloc(LocateArgs({map}, what));
      EXPECT_NE(local.find("latitude"), std::string::npos);
      for (const char* send : {"scan", "descriptor"}) {
        const std::string served = MustScanloc(
            LocateArgs({"--server", server.address(), "--map", "one", "--send", send}, what));
        EXPECT_EQ(served, local) << method << " " << form << " " << send;
      }
    }
  }
  EXPECT_EQ(server.Stop(), 0);
}

TEST(ServedAnswers, SayWhichOfTheMapsWhereNoneIsNamed) {
  const TempDir dir;
  MustScanloc({"simulate", dir.File("far"), "--town-seed", "9", "--length-m", "60", "--quiet"});
  MustScanloc({"build", dir.File("far.scanloc"), "--scans", dir.File("far"), "--poses",
               dir.File("far/poses.txt"), "--quiet"});
  RunningServer server({"far=" + dir.File("far.scanloc"), "one=" + Town().map1});
  for (const char* send : {"scan", "descriptor"}) {
    const Args what = {"--server", server.address(), "--send", send, "--csv", "-"};
    const report::CsvTable told = ParseCsv(MustScanloc(LocateArgs(what, {})));
    int num_localized = 0;
    for (std::size_t row = 0; row < told.num_rows(); ++row) {
      if (told.Text(row, "outcome") != "localized") continue;
      ++num_localized;
      EXPECT_EQ(told.Text(row, "map"), "one");
    }
    EXPECT_GT(num_localized, TinyTown::kNumScans / 2);
  }
  const ProcessResult stream = Scanloc(LocateArgs({"--server", server.address()}, {"--sequence"}));
  EXPECT_EQ(stream.status, 1);
  EXPECT_NE(stream.err.find("names no map and this server has several; it has far, one"),
            std::string::npos)
      << stream.err;
  EXPECT_EQ(server.Stop(), 0);
}

TEST(ServedAnswers, AreAnnouncedByHealth) {
  RunningServer server({"one=" + Town().map1});
  for (const Args& map : {Args{}, Args{"--map", "one"}}) {
    Args args = {"health", "--server", server.address()};
    args.insert(args.end(), map.begin(), map.end());
    EXPECT_EQ(MustScanloc(args), "serving\n");
  }
  EXPECT_EQ(Scanloc({"health", "--server", server.address(), "--map", "two"}).status, 1);
  EXPECT_EQ(server.Stop(), 0);
  const ProcessResult gone = Scanloc({"health", "--server", server.address()});
  EXPECT_EQ(gone.status, 1);
  EXPECT_NE(gone.err.find(server.address()), std::string::npos) << gone.err;
}

TEST(ServedAnswers, SayWhatMapsThereAre) {
  RunningServer server({"one=" + Town().map1});
  const nlohmann::json file = nlohmann::json::parse(MustScanloc({"info", Town().map1, "--json"}));
  const Args ask = {"info", "--server", server.address(), "--json"};
  const nlohmann::json list = nlohmann::json::parse(MustScanloc(ask));
  ASSERT_EQ(list.at("maps").size(), 1U);
  EXPECT_EQ(list.at("maps")[0].at("name"), "one");
  EXPECT_EQ(list.at("maps")[0].at("content_id"), file.at("content_id"));
  Args one = ask;
  one.insert(one.end(), {"--map", "one"});
  const nlohmann::json map = nlohmann::json::parse(MustScanloc(one));
  for (const char* field : {"content_id", "num_places", "params", "extent"}) {
    EXPECT_EQ(map.at(field), file.at(field)) << field;
  }
  EXPECT_NE(MustScanloc({"info", "--server", server.address()}).find("serving"), std::string::npos);
  one.back() = "two";
  EXPECT_EQ(Scanloc(one).status, 1);
  EXPECT_EQ(Scanloc({"info"}).status, 2);
  EXPECT_EQ(Scanloc({"info", Town().map1, "--map", "one"}).status, 2);
  EXPECT_EQ(server.Stop(), 0);
}

TEST(ServedAnswers, WithoutAPlaceAreReplayedFromWhatTheServerKept) {
  const TempDir kept;
  // No confidence is 1: nothing is localized, all is kept.
  const Args what = {"--min-confidence", "1", "--csv", "-"};
  for (const char* send : {"scan", "descriptor"}) {
    RunningServer server({"one=" + Town().map1}, {"--capture-dir", kept.path().string()});
    const std::string served =
        MustScanloc(LocateArgs({"--server", server.address(), "--send", send}, what));
    EXPECT_EQ(server.Stop(), 0);
    const report::CsvTable asked = ParseCsv(served);
    const report::CsvTable replayed = ParseCsv(
        MustScanloc({"locate", Town().map1, "--replay", kept.path().string(), "--csv", "-"}));
    ASSERT_EQ(replayed.num_rows(), asked.num_rows()) << send;
    for (std::size_t row = 0; row < asked.num_rows(); ++row) {
      for (const char* column : {"outcome", "place", "confidence", "x", "y", "z", "qz", "qw"}) {
        EXPECT_EQ(replayed.Text(row, column), asked.Text(row, column)) << send << " " << column;
      }
      EXPECT_NE(replayed.Text(row, "outcome"), "localized");
    }
    for (const auto& file : std::filesystem::directory_iterator(kept.path())) {
      const ProcessResult better = RunProcess({kScanloc, "locate", Town().map1, "--replay",
                                               file.path().string(), "--min-confidence", "0.5"});
      EXPECT_EQ(better.status, 0) << better.err;
      EXPECT_NE(better.out.find("localized"), std::string::npos) << better.out;
      std::filesystem::remove(file.path());
    }
  }
}

TEST(ServedAnswers, AreNotReplayedFromFilesThatHoldNone) {
  const TempDir dir;
  for (const std::string& path :
       {dir.Write("garbage.query", "no query"), dir.Write("empty.query", ""),
        dir.File("absent.query"), dir.path().string()}) {
    const ProcessResult refused = RunProcess({kScanloc, "locate", Town().map1, "--replay", path});
    EXPECT_EQ(refused.status, 1) << path;
    EXPECT_NE(refused.err.find(dir.path().string()), std::string::npos) << refused.err;
  }
}

TEST(ServedAnswers, OfASequenceAreThoseOfTheMapFileByteForByte) {
  RunningServer server({"one=" + Town().map1});
  for (const Args& odometry : {Args{}, Args{"--odometry", Town().Poses2()}}) {
    Args what = {"--sequence", "--csv", "-", "--truth", Town().Poses2()};
    what.insert(what.end(), odometry.begin(), odometry.end());
    const std::string local = MustScanloc(LocateArgs({Town().map1}, what));
    const report::CsvTable table = ParseCsv(local);
    for (std::size_t row = 0; row < table.num_rows(); ++row) {
      EXPECT_EQ(table.Text(row, "outcome"), "localized");
      EXPECT_EQ(table.Text(row, "num_scans"), std::to_string(row + 1));
      EXPECT_EQ(table.Text(row, "relocated"), "0");
    }
    for (const char* send : {"scan", "descriptor"}) {
      EXPECT_EQ(MustScanloc(LocateArgs({"--server", server.address(), "--send", send}, what)),
                local);
    }
  }
}

TEST(ServedAnswers, LookWhereThePriorSays) {
  RunningServer server({"one=" + Town().map1});
  const Args what = {"--json", "--prior", "0,0,15", "--prior-session", "one"};
  const std::string local = MustScanloc(LocateArgs({Town().map1}, what));
  EXPECT_EQ(MustScanloc(LocateArgs({"--server", server.address()}, what)), local);
  const auto document = nlohmann::json::parse(local);
  EXPECT_EQ(document.at("prior").at("disc").at("radius_m"), 15.0);
  EXPECT_EQ(document.at("prior").at("sessions"), nlohmann::json({"one"}));
  for (const auto& query : document.at("queries")) {
    for (const auto& candidate : query.at("candidates")) {
      const auto& place = candidate.at("T_map_place");
      EXPECT_LE(std::hypot(place.at("x").get<double>(), place.at("y").get<double>()), 15.0);
    }
  }
  const ProcessResult unknown =
      Scanloc(LocateArgs({Town().map1}, {"--prior-session", "two", "--json"}));
  EXPECT_EQ(unknown.status, 1);
  EXPECT_NE(unknown.err.find("session \"two\""), std::string::npos) << unknown.err;
}

TEST(ServedAnswers, HoldToTheMapsDefaultsAndTheQuerysChoices) {
  RunningServer server({"one=" + Town().map1});
  for (const Args& choice :
       {Args{}, Args{"--candidates", "5", "--method", "a-pc", "--threshold", "0.1"},
        Args{"--candidates", "5", "--min-confidence", "0.99", "--budget-ms", "60000"}}) {
    Args what = {"--csv", "-"};
    what.insert(what.end(), choice.begin(), choice.end());
    EXPECT_EQ(MustScanloc(LocateArgs({"--server", server.address()}, what)),
              MustScanloc(LocateArgs({Town().map1}, what)));
  }
}

TEST(ServedAnswers, ComeFromTheMapThatWasNamed) {
  const TempDir dir;
  MustScanloc({"build", dir.File("two"), "--scans", Town().drive2, "--poses", Town().Poses2(),
               "--polar-sectors", "40", "--quiet"});
  RunningServer server({"one=" + Town().map1, "two=" + dir.File("two")});
  for (const auto& [name, file] :
       {std::pair<std::string, std::string>("one", Town().map1), {"two", dir.File("two")}}) {
    for (const char* send : {"scan", "descriptor"}) {
      EXPECT_EQ(MustScanloc(LocateArgs(
                    {"--server", server.address(), "--map", name, "--send", send}, {"--json"})),
                MustScanloc(LocateArgs({file}, {"--json"})))
          << name << " " << send;
    }
  }
  const ProcessResult unknown =
      Scanloc(LocateArgs({"--server", server.address(), "--map", "three"}, {}));
  EXPECT_EQ(unknown.status, 1);
  EXPECT_NE(unknown.err.find("three"), std::string::npos) << unknown.err;
  EXPECT_EQ(CountLines(unknown.err), 1) << unknown.err;
}

TEST(ServedAnswers, StopWithTheServer) {
  RunningServer server({"one=" + Town().map1});
  EXPECT_EQ(server.Stop(), 0);
  const ProcessResult result =
      Scanloc(LocateArgs({"--server", server.address(), "--deadline-s", "1"}, {}));
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
}

TEST(ServedAnswers, NeedAMapThatLoads) {
  const TempDir dir;
  const ProcessResult result = RunProcess(
      {kScanlocd, "--listen", "127.0.0.1:0", "--map", "one=" + dir.Write("map", "garbage")});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(result.out, "");
}

}  // namespace
}  // namespace scanloc::test

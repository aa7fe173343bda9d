// From a drive to answers: simulate, build, info, verify, locate, export, merge.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "e2e/programs.hpp"
#include "scanloc/report/csv.hpp"

namespace scanloc::test {
namespace {

using nlohmann::json;
using report::CsvTable;

constexpr const char* kHeader =
    "query,outcome,place,session,distance,confidence,yaw_deg,lateral_m,x,y,z,qx,qy,qz,qw";
constexpr const char* kPoseColumns =
    ",heading_deg,std_x_m,std_y_m,std_z_m,std_roll_deg,std_pitch_deg,std_yaw_deg";

double NumberAt(const CsvTable& table, std::size_t row, const std::string& column) {
  const auto value = table.Number(row, column);
  EXPECT_TRUE(value.ok()) << value.status();
  EXPECT_TRUE(value->has_value()) << column << " of row " << row << " is empty";
  return value->value_or(0.0);
}

TEST(FirstPath, SimulateGivesTheSameBytesAgain) {
  const TempDir dir;
  MustScanloc({"simulate", dir.File("again"), "--town-seed", "3", "--length-m", "60", "--rays",
               "16", "--azimuths", "360", "--spacing-m", "2", "--session-seed", "1", "--threads",
               "1"});
  for (const char* file : {"velodyne/000000.bin", "velodyne/000029.bin", "poses.txt"}) {
    EXPECT_EQ(ReadFile(dir.path() / "again" / file),
              ReadFile(std::filesystem::path(Town().drive1) / file))
        << file;
  }
}

TEST(FirstPath, InfoTellsWhatBuildDid) {
  const json info = json::parse(MustScanloc({"info", Town().map1, "--json"}));
  EXPECT_EQ(info.at("num_places"), TinyTown::kNumScans);
  EXPECT_EQ(info.at("schema_version"), 16);
  EXPECT_EQ(info.at("complete"), true);
  ASSERT_EQ(info.at("sessions").size(), 1);
  EXPECT_EQ(info.at("sessions")[0].at("name"), "one");
  EXPECT_EQ(info.at("sessions")[0].at("num_places"), TinyTown::kNumScans);
  EXPECT_EQ(info.at("params").at("polar.num_sectors"), 60);
  EXPECT_EQ(info.at("params").at("polar.root_shifts_m"), json({2.0, -2.0}));
  EXPECT_EQ(info.at("params").at("cart.shift_mode"), "bounded");
  EXPECT_LT(info.at("extent").at("min_m").at("x"), info.at("extent").at("max_m").at("x"));
  EXPECT_EQ(info.at("file_bytes"), std::filesystem::file_size(Town().map1));
  const std::string text = MustScanloc({"info", Town().map1});
  EXPECT_NE(text.find(info.at("content_id").get<std::string>()), std::string::npos);
  EXPECT_NE(text.find("cart.max_shift_cols"), std::string::npos);
}

TEST(FirstPath, BuildSetsEveryParameter) {
  const TempDir dir;
  Args args = BuildArgs(dir.File("map"));
  const Args more = {"--descriptors",
                     "pc,cc",
                     "--voxel-size-m",
                     "0.4",
                     "--sensor-height-m",
                     "1.8",
                     "--polar-rings",
                     "10",
                     "--polar-sectors",
                     "30",
                     "--polar-range-m",
                     "60",
                     "--root-shifts-m",
                     "3,-1",
                     "--cart-rows",
                     "20",
                     "--cart-cols",
                     "22",
                     "--cart-x-m",
                     "50",
                     "--cart-y-m",
                     "30",
                     "--cart-shift-mode",
                     "circular",
                     "--cart-max-shift-cols",
                     "5",
                     "--candidates",
                     "7",
                     "--align-radius",
                     "2",
                     "--polar-threshold",
                     "0.4",
                     "--cart-threshold",
                     "0.2",
                     "--min-confidence",
                     "0.6",
                     "--min-voxels",
                     "9"};
  args.insert(args.end(), more.begin(), more.end());
  MustScanloc(args);
  const json expected = {{"voxel_size_m", 0.4},
                         {"sensor_height_m", 1.8},
                         {"polar.enabled", true},
                         {"polar.num_rings", 10},
                         {"polar.num_sectors", 30},
                         {"polar.max_range_m", 60.0},
                         {"polar.root_shifts_m", {3.0, -1.0}},
                         {"cart.enabled", true},
                         {"cart.num_rows", 20},
                         {"cart.num_cols", 22},
                         {"cart.max_x_m", 50.0},
                         {"cart.max_y_m", 30.0},
                         {"cart.double_flip", true},
                         {"cart.shift_mode", "circular"},
                         {"cart.max_shift_cols", 5},
                         {"structure.enabled", true},
                         {"search.min_confidence", 0.6},
                         {"search.num_candidates", 7},
                         {"search.align_radius", 2},
                         {"search.polar_threshold", 0.4},
                         {"search.cart_threshold", 0.2},
                         {"search.min_voxels", 9}};
  json told = json::parse(MustScanloc({"info", dir.File("map"), "--json"})).at("params");
  for (auto field = told.begin(); field != told.end();) {  // auto's come from its scale
    field = field.key().starts_with("auto.") ? told.erase(field) : std::next(field);
  }
  EXPECT_EQ(told, expected);
}

TEST(FirstPath, MapWithOneKindServesOnlyItsMethods) {
  const TempDir dir;
  Args args = BuildArgs(dir.File("map"));
  args.insert(args.end(), {"--descriptors", "cc", "--no-augment", "--no-keep-scans"});
  MustScanloc(args);
  const json params = json::parse(MustScanloc({"info", dir.File("map"), "--json"})).at("params");
  EXPECT_EQ(params.at("polar.enabled"), false);
  EXPECT_EQ(params.at("cart.double_flip"), false);
  const Args locate = {"locate", dir.File("map"), "--scans", Town().drive1, "--json", "--quiet"};
  EXPECT_EQ(json::parse(MustScanloc(locate)).at("method"), "a-cc");
  Args polar = locate;
  polar.insert(polar.end(), {"--method", "pc"});
  const ProcessResult refused = Scanloc(polar);
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("--descriptors pc"), std::string::npos) << refused.err;
  Args automatic = locate;
  automatic.insert(automatic.end(), {"--method", "auto"});
  const ProcessResult refused_auto = Scanloc(automatic);
  EXPECT_EQ(refused_auto.status, 1);
  EXPECT_NE(refused_auto.err.find("--keep-scans"), std::string::npos) << refused_auto.err;
}

TEST(FirstPath, VerifyFindsSoundMapSound) {
  EXPECT_EQ(MustScanloc({"verify", Town().map1}), Town().map1 + " is sound\n");
}

TEST(FirstPath, VerifyListsDamage) {
  const TempDir dir;
  std::string bytes = ReadFile(Town().map1);
  bytes[bytes.size() * 3 / 4] ^= 1;
  const ProcessResult result = Scanloc({"verify", dir.Write("damaged", bytes)});
  EXPECT_EQ(result.status, 1);
  EXPECT_GE(CountLines(result.out), 1);
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
}

TEST(FirstPath, MappedScansAreFoundWhereTheyWereTaken) {
  const CsvTable table =
      ParseCsv(MustScanloc({"locate", Town().map1, "--scans", Town().drive1, "--truth",
                            Town().Poses1(), "--method", "a-pc", "--csv", "-", "--quiet"}));
  ASSERT_EQ(table.num_rows(), TinyTown::kNumScans);
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    EXPECT_EQ(table.Text(row, "outcome"), "localized");
    EXPECT_EQ(NumberAt(table, row, "place"), static_cast<double>(row));
    EXPECT_EQ(table.Text(row, "session"), "one");
    EXPECT_EQ(table.Text(row, "distance"), "0.000000");
    EXPECT_EQ(table.Text(row, "confidence"), "");
    EXPECT_EQ(table.Text(row, "yaw_deg"), "0.000000000");
    EXPECT_LT(NumberAt(table, row, "error_m"), 1e-6);
    EXPECT_LT(NumberAt(table, row, "yaw_error_deg"), 1e-6);
  }
}

TEST(FirstPath, OtherSessionIsLocatedByDefaultWithConfidence) {
  const CsvTable table =
      ParseCsv(MustScanloc({"locate", Town().map1, "--scans", Town().drive2, "--truth",
                            Town().Poses2(), "--csv", "-", "--quiet"}));
  ASSERT_EQ(table.num_rows(), TinyTown::kNumScans);
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    EXPECT_EQ(table.Text(row, "outcome"), "localized");
    EXPECT_GE(NumberAt(table, row, "confidence"), 0.8);
    EXPECT_LT(NumberAt(table, row, "error_m"), 0.6);
    EXPECT_LT(NumberAt(table, row, "yaw_error_deg"), 1.0);
  }
}

TEST(FirstPath, OtherSessionIsRecalledByEveryMethod) {
  for (const char* method : {"auto", "pc", "cc", "a-pc", "a-cc"}) {
    const json answers =
        json::parse(MustScanloc({"locate", Town().map1, "--scans", Town().drive2, "--truth",
                                 Town().Poses2(), "--method", method, "--json", "--quiet"}));
    EXPECT_GE(answers.at("summary").at("recall_at_1"), 0.8) << method;
    EXPECT_LT(answers.at("summary").at("median_error_m"), 3.0) << method;
    EXPECT_EQ(answers.at("method"), method);
    EXPECT_EQ(answers.at("content_id"), ContentId(Town().map1));
  }
}

TEST(FirstPath, CsvHasTheDocumentedColumnsAndMoreOnlyWhenAsked) {
  const Args locate = {"locate", Town().map1, "--scans", Town().drive2, "--quiet", "--csv", "-"};
  const std::string plain = MustScanloc(locate);
  EXPECT_EQ(plain.substr(0, plain.find('\n')), std::string(kHeader) + kPoseColumns);
  EXPECT_EQ(CountLines(plain), TinyTown::kNumScans + 1);
  Args more = locate;
  more.insert(more.end(), {"--top", "3", "--truth", Town().Poses2()});
  const std::string ranked = MustScanloc(more);
  EXPECT_EQ(
      ranked.substr(0, ranked.find('\n')),
      std::string(kHeader) +
          ",rank,true_place_error_m,error_m,yaw_error_deg,true_x,true_y,height_error_m,missed" +
          kPoseColumns);
  EXPECT_EQ(CountLines(ranked), 3 * TinyTown::kNumScans + 1);
  const CsvTable table = ParseCsv(ranked);
  EXPECT_EQ(table.Text(0, "rank"), "1");
  EXPECT_EQ(table.Text(2, "rank"), "3");
  EXPECT_LE(NumberAt(table, 0, "distance"), NumberAt(table, 2, "distance"));
}

TEST(FirstPath, SelectionTakesTheScansItNames) {
  const auto queries = [](const Args& selection) {
    Args args = {"locate", Town().map1, "--scans", Town().drive2, "--quiet", "--csv", "-"};
    args.insert(args.end(), selection.begin(), selection.end());
    const CsvTable table = ParseCsv(MustScanloc(args));
    std::vector<std::string> names;
    for (std::size_t row = 0; row < table.num_rows(); ++row) {
      names.push_back(table.Text(row, "query"));
    }
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(queries({"--from", "3", "--to", "4"}), Names({"000003.bin", "000004.bin"}));
  EXPECT_EQ(queries({"--every", "13", "--offset", "2"}),
            Names({"000002.bin", "000015.bin", "000028.bin"}));
  EXPECT_EQ(queries({"--every", "2", "--offset", "1", "--from", "26"}),
            Names({"000027.bin", "000029.bin"}));
}

TEST(FirstPath, EverySecondScanIsMappedAndTheOthersAreFound) {
  const TempDir dir;
  Args args = BuildArgs(dir.File("half"));
  args.insert(args.end(), {"--every", "2"});
  MustScanloc(args);
  const json answers =
      json::parse(MustScanloc({"locate", dir.File("half"), "--scans", Town().drive1, "--every", "2",
                               "--offset", "1", "--truth", Town().Poses1(), "--json", "--quiet"}));
  EXPECT_EQ(answers.at("queries").size(), TinyTown::kNumScans / 2);
  EXPECT_GE(answers.at("summary").at("recall_at_1"), 0.9);
}

TEST(FirstPath, TableAndSummaryAreForPeople) {
  const std::string text = MustScanloc(
      {"locate", Town().map1, "--scans", Town().drive2, "--truth", Town().Poses2(), "--quiet"});
  EXPECT_NE(text.find("000029.bin  "), std::string::npos);
  EXPECT_NE(text.find("recall@1"), std::string::npos);
  const std::string one = MustScanloc(
      {"locate", Town().map1, "--scan", Town().drive2 + "/velodyne/000007.bin", "--quiet"});
  EXPECT_NE(one.find("000007.bin  "), std::string::npos);
}

TEST(FirstPath, SummaryStaysOffStdoutWhenAnswersGoThere) {
  const ProcessResult result =
      Scanloc({"locate", Town().map1, "--scans", Town().drive2, "--csv", "-"});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(CountLines(result.out), TinyTown::kNumScans + 1);
  EXPECT_NE(result.err.find("30 queries"), std::string::npos);
  EXPECT_NE(result.err.find("30 of 30 scans located (100 %)"), std::string::npos);
}

TEST(FirstPath, AppendAndMergeHoldTheSamePlaces) {
  const TempDir dir;
  MustScanloc(BuildArgs(dir.File("both")));
  const std::string told =
      MustScanloc({"build", dir.File("both"), "--scans", Town().drive2, "--poses", Town().Poses2(),
                   "--spacing-m", "0", "--append", "--quiet"});
  EXPECT_NE(told.find("30 new, 60 in the map"), std::string::npos) << told;
  MustScanloc({"build", dir.File("two"), "--scans", Town().drive2, "--poses", Town().Poses2(),
               "--spacing-m", "0", "--quiet"});
  MustScanloc({"merge", dir.File("merged"), Town().map1, dir.File("two")});
  const json both = json::parse(MustScanloc({"info", dir.File("both"), "--json"}));
  const json merged = json::parse(MustScanloc({"info", dir.File("merged"), "--json"}));
  EXPECT_EQ(both.at("num_places"), 2 * TinyTown::kNumScans);
  EXPECT_EQ(merged.at("num_places"), both.at("num_places"));
  EXPECT_EQ(merged.at("content_id"), both.at("content_id"));
  EXPECT_EQ(both.at("sessions")[1].at("name"), "drive2") << "named after its folder";
}

TEST(FirstPath, ExportWritesEveryPlace) {
  const CsvTable places = ParseCsv(MustScanloc({"export", Town().map1}));
  ASSERT_EQ(places.num_rows(), TinyTown::kNumScans);
  EXPECT_EQ(places.Text(7, "place"), "7");
  EXPECT_EQ(places.Text(7, "session"), "one");
  EXPECT_EQ(places.Text(7, "scan"), "000007.bin");
  EXPECT_GT(NumberAt(places, 7, "num_voxels"), 50.0);
  const TempDir dir;
  MustScanloc({"export", Town().map1, "--format", "tum", "--out", dir.File("places.tum")});
  // What was written is a trajectory that can be read back.
  MustScanloc({"build", dir.File("again"), "--scans", Town().drive1, "--poses",
               dir.File("places.tum"), "--format", "tum", "--spacing-m", "0", "--quiet"});
}

}  // namespace
}  // namespace scanloc::test

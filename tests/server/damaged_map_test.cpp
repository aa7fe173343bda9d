// Map files that are damaged at the start of a real server, or under it while it runs.
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "metered_scanlocd.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/same_answer.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;
using grpc::health::v1::HealthCheckResponse;
using ::testing::HasSubstr;

/// One way in which a file goes bad under a server.
struct Damage {
  const char* name;
  void (*damage)(const std::string& path);

  friend void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }
};

/// Writes into the file itself, as `cp` does: whoever holds it open sees it.
void OverwriteInPlace(const std::string& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << bytes;
  out.close();
  if (!out) throw std::runtime_error("cannot overwrite " + path);
}

const Damage kDamages[] = {
    {"ReplacedByGarbage",
     [](const std::string& path) {
       OverwriteInPlace(path + ".next", "not a map");
       fs::rename(path + ".next", path);
     }},
    {"TruncatedInPlace",
     [](const std::string& path) { fs::resize_file(path, fs::file_size(path) / 2); }},
    {"EmptiedInPlace", [](const std::string& path) { fs::resize_file(path, 0); }},
    {"CutByOneByte",
     [](const std::string& path) { fs::resize_file(path, fs::file_size(path) - 1); }},
    {"CopiedOverByGarbage",
     [](const std::string& path) {
       OverwriteInPlace(path, std::string(fs::file_size(path), '\x5a'));
     }},
    {"ScribbledOnInPlace",
     [](const std::string& path) {
       std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
       for (std::uint64_t at = 5000; at < fs::file_size(path); at += 4096) {
         file.seekp(static_cast<std::streamoff>(at));
         file << "scribble";
       }
     }},
    {"Deleted", [](const std::string& path) { fs::remove(path); }},
    {"ReplacedByAFolder",
     [](const std::string& path) {
       fs::remove(path);
       fs::create_directory(path);
     }},
};

class DamagedMapTest : public MeteredScanlocdTest {
 protected:
  static constexpr char kFailures[] = "scanloc_map_reload_failures_total{map=\"town\"}";

  void StartOnTown(const std::vector<std::string>& front = {}) {
    path_ = WriteMap("town", 1);
    localizer_ = test::LocalizerOf(mapdb::LoadMap(path_).value());
    std::vector<std::string> arguments = AdminArguments();
    arguments.insert(arguments.end(), {"--map", "town=" + path_});
    StartMetered(arguments, {}, front);
  }

  void ExpectAnswersAsBefore() const {
    const client::Client robot = ConnectAs(kQueryToken);
    auto describer = Describer::Create(Params()).value();
    for (int place = 0; place < kNumPlaces; ++place) {
      const PointCloud scan = test::QueryScan(1, place);
      const auto reply = robot.LocalizeScan(scan);
      ASSERT_TRUE(reply.ok()) << reply.status();
      test::ExpectSameAnswer(reply->answer, localizer_->Localize(describer.Describe(scan)).value());
    }
    EXPECT_EQ(HealthOf("town"), HealthCheckResponse::SERVING);
  }

  /// Every way to reload says that it did not.
  void ExpectRefusesToReload() {
    const absl::Status refused = ConnectAs(kAdminToken).ReloadMap("town").status();
    EXPECT_FALSE(refused.ok());
    EXPECT_THAT(std::string(refused.message()), HasSubstr("map town: "));
    EXPECT_EQ(Metric(kFailures), 1.0);
    scanlocd_->Signal(SIGHUP);
    AwaitMetric(kFailures, [](double value) { return value == 2.0; });
    Await("a line in the log",
          [this] { return Log().find("not reloaded: map town: ") != std::string::npos; });
  }

  /// A new map in the file's place is taken up.
  void ExpectReloadsOnceRestored() {
    const client::Client admin = ConnectAs(kAdminToken);
    fs::remove_all(path_);
    ASSERT_EQ(WriteMap("town", 2), path_);
    ASSERT_EQ(chmod(path_.c_str(), 0644), 0);
    const auto map = admin.ReloadMap("town");
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_EQ(map->generation, 2U);
    const auto reply = admin.LocalizeScan(test::QueryScan(2, 3));
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->answer.candidates.front().place, 3);
  }

  std::string path_;
  std::shared_ptr<const Localizer> localizer_;
};

class DamageWhileRunning : public DamagedMapTest, public testing::WithParamInterface<Damage> {};

TEST_P(DamageWhileRunning, LeavesTheMapServingAndIsTold) {
  StartOnTown();
  ExpectAnswersAsBefore();
  GetParam().damage(path_);
  ExpectAnswersAsBefore();
  ExpectRefusesToReload();
  ExpectAnswersAsBefore();
  ExpectReloadsOnceRestored();
}

INSTANTIATE_TEST_SUITE_P(Faults, DamageWhileRunning, testing::ValuesIn(kDamages),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_F(DamagedMapTest, LeavesTheMapServingWhenTheFileMayNoLongerBeRead) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can run the server as another user";
  const std::vector<std::string> as_nobody = {"/usr/bin/setpriv", "--reuid=65534", "--regid=65534",
                                              "--clear-groups"};
  std::vector<std::string> version = as_nobody;
  version.insert(version.end(), {test::BinDir() + "/scanlocd", "--version"});
  if (!fs::exists(as_nobody.front()) || test::RunProcess(version).status != 0) {
    GTEST_SKIP() << "another user cannot run " << version[4];
  }
  ASSERT_EQ(chmod(dir_.path().c_str(), 0755), 0);
  StartOnTown(as_nobody);
  ASSERT_EQ(chmod(path_.c_str(), 0), 0);
  ExpectRefusesToReload();
  ExpectAnswersAsBefore();
  ExpectReloadsOnceRestored();
}

TEST_F(DamagedMapTest, IsToldAtTheStartWhileTheGoodMapsServe) {
  const std::string good = WriteMap("good", 1);
  std::vector<std::string> arguments = {"--map", "good=" + good};
  std::vector<std::string> names;
  for (const Damage& damage : kDamages) {
    const std::string path = WriteMap(damage.name, 1);
    damage.damage(path);
    arguments.insert(arguments.end(), {"--map", std::string(damage.name) + "=" + path});
    names.emplace_back(damage.name);
  }
  StartMetered(arguments);
  EXPECT_EQ(HealthOf(), HealthCheckResponse::SERVING);
  EXPECT_EQ(HealthOf("good"), HealthCheckResponse::SERVING);
  const client::Client client = Connect();
  EXPECT_TRUE(client.LocalizeScan(test::QueryScan(1, 2), {.map = "good"}).ok());
  const auto maps = client.ListMaps();
  ASSERT_TRUE(maps.ok()) << maps.status();
  for (const MapSummary& map : *maps) {
    EXPECT_EQ(map.state, map.name == "good" ? MapState::kServing : MapState::kFailed) << map.name;
  }
  const std::string log = Log();
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    EXPECT_EQ(HealthOf(name), HealthCheckResponse::NOT_SERVING);
    EXPECT_THAT(log, HasSubstr("map " + name + ": "));
    EXPECT_EQ(Metric("scanloc_map_reload_failures_total{map=\"" + name + "\"}"), 1.0);
    EXPECT_EQ(Metric("scanloc_map_serving{map=\"" + name + "\"}"), 0.0);
    EXPECT_EQ(client.LocalizeScan(test::QueryScan(1, 2), {.map = name}).status().code(),
              absl::StatusCode::kUnavailable);
  }
  ExpectStopsWell();
}

}  // namespace
}  // namespace scanloc::server

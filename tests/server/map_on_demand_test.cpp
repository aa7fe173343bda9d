// Maps of a real server that stay in their files: answered from at once, checked in the background.
#include <filesystem>
#include <fstream>

#include "metered_scanlocd.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/same_answer.hpp"
#include "support/sql.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;
using grpc::health::v1::HealthCheckResponse;
using ::testing::HasSubstr;

class MapOnDemandTest : public MeteredScanlocdTest {
 protected:
  static constexpr char kChecked[] = "scanloc_map_checked_places{map=\"town\"}";
  static constexpr char kDamaged[] = "scanloc_map_damaged_total{map=\"town\"}";
  /// Of the last place, so that a check comes to it late.
  static constexpr char kDamage[] = "UPDATE structures SET posts = zeroblob(8) WHERE place = 7";

  void SetUp() override {
    path_ = WriteMap("town", 1);
    localizer_ = test::LocalizerOf(mapdb::LoadMap(path_).value());
  }

  void StartOnTown() {
    std::vector<std::string> arguments = AdminArguments();
    arguments.insert(arguments.end(), {"--map", "town=" + path_, "--whole-bytes", "0",
                                       "--cache-bytes", "0", "--threads", "3"});
    StartMetered(arguments);
  }

  /// Asks about each place: the answer that the whole map gives, or that the map is out of service.
  /// Gives the number of answers.
  int AskAll() {
    const client::Client robot = ConnectAs(kQueryToken);
    auto describer = Describer::Create(Params()).value();
    int num_answers = 0;
    for (int place = 0; place < kNumPlaces; ++place) {
      const PointCloud scan = test::QueryScan(1, place);
      const auto reply = robot.LocalizeScan(scan);
      if (reply.ok()) {
        ++num_answers;
        test::ExpectSameAnswer(reply->answer,
                               localizer_->Localize(describer.Describe(scan)).value());
      } else {
        EXPECT_EQ(reply.status().code(), absl::StatusCode::kUnavailable) << reply.status();
        EXPECT_EQ(std::string(reply.status().message()).find(path_), std::string::npos);
      }
    }
    return num_answers;
  }

  void AwaitChecked() {
    Await("the map is checked",
          [this] { return HealthOf("town/checked") == HealthCheckResponse::SERVING; });
    EXPECT_EQ(Metric(kChecked), kNumPlaces);
  }

  void ExpectOutOfService() {
    AwaitMetric(kDamaged, [](double value) { return value == 1.0; });
    EXPECT_EQ(HealthOf("town"), HealthCheckResponse::NOT_SERVING);
    EXPECT_EQ(HealthOf("town/checked"), HealthCheckResponse::NOT_SERVING);
    EXPECT_EQ(HealthOf(), HealthCheckResponse::NOT_SERVING);
    EXPECT_EQ(Metric("scanloc_map_serving{map=\"town\"}"), 0.0);
    EXPECT_THAT(Log(), HasSubstr("map town taken out of service: map '" + path_ + "' is damaged"));
    EXPECT_EQ(AskAll(), 0);
  }

  std::string path_;
  std::shared_ptr<const Localizer> localizer_;
};

TEST_F(MapOnDemandTest, AnswersAsTheWholeMapAndTellsWhenItIsChecked) {
  StartOnTown();
  EXPECT_EQ(AskAll(), kNumPlaces);
  AwaitChecked();
  EXPECT_EQ(AskAll(), kNumPlaces);
  EXPECT_EQ(Metric(kDamaged), 0.0);
  ExpectStopsWell();
}

TEST_F(MapOnDemandTest, GoesOutOfServiceOnceDamageIsFound) {
  test::Sql(path_, kDamage);
  StartOnTown();
  AskAll();
  ExpectOutOfService();
  fs::remove(path_);
  ASSERT_EQ(WriteMap("town", 1), path_);
  ASSERT_TRUE(ConnectAs(kAdminToken).ReloadMap("town").ok());
  EXPECT_EQ(AskAll(), kNumPlaces);
  AwaitChecked();
}

TEST_F(MapOnDemandTest, GoesOutOfServiceWhenAQueryReadsDamage) {
  StartOnTown();
  AwaitChecked();
  test::Sql(path_, "UPDATE structures SET posts = zeroblob(4)");
  EXPECT_EQ(AskAll(), 0);
  ExpectOutOfService();
}

TEST_F(MapOnDemandTest, StaysInServiceWhenAReloadFindsDamage) {
  StartOnTown();
  const std::string next = WriteMap("next", 2);
  test::Sql(next, kDamage);
  fs::rename(next, path_);
  const absl::Status refused = ConnectAs(kAdminToken).ReloadMap("town").status();
  EXPECT_THAT(std::string(refused.message()), HasSubstr("map town: "));
  EXPECT_EQ(AskAll(), kNumPlaces);
  AwaitChecked();
}

TEST_F(MapOnDemandTest, AnswersWhileTheFileIsAppendedTo) {
  StartOnTown();
  mapdb::SessionPlan plan{.name = "evening", .scans = {{.name = "one"}}};
  auto builder = mapdb::MapBuilder::Append(path_, plan);
  ASSERT_TRUE(builder.ok()) << builder.status();
  EXPECT_EQ(AskAll(), kNumPlaces);
  ASSERT_TRUE(builder->Add(Describer::Create(Params())->DescribePlace(test::PlaceScan(5, 0))).ok());
  ASSERT_TRUE(builder->Finish().ok());
  EXPECT_EQ(AskAll(), kNumPlaces);
  ASSERT_TRUE(ConnectAs(kAdminToken).ReloadMap("town").ok());
  EXPECT_EQ(Metric("scanloc_map_places{map=\"town\"}"), kNumPlaces + 1);
}

TEST_F(MapOnDemandTest, IsLostToOthersInPlaceWithoutACrash) {
  StartOnTown();
  const std::string other = test::ReadFile(WriteMap("other", 2));
  std::ofstream(path_, std::ios::binary | std::ios::trunc) << other.substr(0, other.size() / 2);
  EXPECT_EQ(AskAll(), 0);
  ExpectOutOfService();
  ExpectStopsWell();
}

}  // namespace
}  // namespace scanloc::server

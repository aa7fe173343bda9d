// Queries without a place, kept for replay.
#include "ops/query_capture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "observability_fixture.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/v1/capture.pb.h"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

class CaptureTest : public ObservabilityTest {
 protected:
  [[nodiscard]] std::vector<std::filesystem::path> Files() const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(dir_.path())) {
      files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
  }

  [[nodiscard]] ServerOptions Capturing() const {
    ServerOptions options = Options();
    options.capture_dir = dir_.path();
    return options;
  }

  /// A scan of another town, as large as is wanted.
  static v1::LocalizeRequest Lost(std::size_t num_more_points = 0) {
    PointCloud points = test::QueryScan(77, 3);
    points.insert(points.end(), num_more_points, points.front());
    return test::ScanRequest(points);
  }
};

TEST_F(CaptureTest, KeepsAQueryWithoutAPlaceAndWhatWasSaid) {
  Start(Capturing());
  const v1::LocalizeRequest request = Lost();
  ASSERT_TRUE(Ask(request, "robot 7").ok());  // a bad id: replaced
  ASSERT_TRUE(Ask(request, "../../robot-7").ok());
  server_.reset();  // writes what waits
  const auto files = Files();
  ASSERT_EQ(files.size(), 2U);
  EXPECT_THAT(files[1].filename().string(), HasSubstr("______robot-7.query"));
  v1::CapturedQuery query;
  std::ifstream file(files[1], std::ios::binary);
  ASSERT_TRUE(query.ParseFromIstream(&file));
  EXPECT_EQ(query.request_id(), "../../robot-7");
  EXPECT_EQ(query.request().SerializeAsString(), request.SerializeAsString());
  EXPECT_EQ(query.response().outcome(), v1::OUTCOME_NOT_RECOGNIZED);
  EXPECT_EQ(query.response().map(), "town");
  EXPECT_GT(query.received().seconds(), 1'600'000'000);
}

TEST_F(CaptureTest, KeepsWhatCanBeReadBackAndNoPieceOfItCan) {
  Start(Capturing());
  v1::LocalizeRequest request = Lost();
  request.set_map("town");
  request.mutable_options()->set_max_answers(7);
  ASSERT_TRUE(Ask(request, "robot-7").ok());
  server_.reset();
  ASSERT_EQ(Files().size(), 1U);
  const std::string bytes = test::ReadFile(Files().front());
  const auto query = proto::ParseCapturedQuery(bytes);
  ASSERT_TRUE(query.ok()) << query.status();
  EXPECT_EQ(query->request_id, "robot-7");
  EXPECT_EQ(query->map, "town");
  EXPECT_EQ(query->query.max_answers, 7);
  EXPECT_EQ(query->scan.size(), test::QueryScan(77, 3).size());
  EXPECT_EQ(query->reply.answer.outcome, Outcome::kNotRecognized);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    if (length > 300 && length + 300 < bytes.size()) continue;  // within the points
    // Cut between two fields it is a message still, but without a query or an answer.
    const auto piece = proto::ParseCapturedQuery(bytes.substr(0, length));
    EXPECT_EQ(piece.status().code(), absl::StatusCode::kInvalidArgument) << length;
  }
}

TEST_F(CaptureTest, KeepsNoQueryThatFoundItsPlace) {
  Start(Capturing());
  const v1::LocalizeRequest request =
      test::DescriptorRequest(test::QueryScan(1, 1), maps_.at("town").params);
  ASSERT_TRUE(Ask(request).ok());
  ASSERT_EQ(response_.outcome(), v1::OUTCOME_LOCALIZED);
  server_.reset();
  EXPECT_TRUE(Files().empty());
}

// Whoever sends scans of nothing would push out what tells something.
TEST_F(CaptureTest, KeepsNoScanOfNextToNothing) {
  Start(Capturing());
  ASSERT_TRUE(Ask(test::ScanRequest(PointCloud(9, Point{5.0F, 0.0F, 0.0F}))).ok());
  ASSERT_EQ(response_.outcome(), v1::OUTCOME_INSUFFICIENT_SCAN);
  server_.reset();
  EXPECT_TRUE(Files().empty());
}

/// What the folder's files take of the disk.
std::int64_t DiskBytes(const std::vector<std::filesystem::path>& files) {
  std::int64_t num_bytes = 0;
  for (const auto& path : files) {
    struct stat status = {};
    EXPECT_EQ(stat(path.c_str(), &status), 0);
    num_bytes += std::int64_t{status.st_blocks} * 512;
  }
  return num_bytes;
}

TEST_F(CaptureTest, BoundsTheFolderAndDropsTheOldest) {
  ServerOptions options = Capturing();
  options.max_capture_bytes = 1 << 20;
  const std::size_t num_points = Lost().scan().num_points();
  for (std::size_t start = 0; start < 3; ++start) {
    Start(options);
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(Ask(Lost(20'000 + start - num_points)).ok());
    server_.reset();
    EXPECT_LE(DiskBytes(Files()), 1 << 20);
  }
  const auto files = Files();
  EXPECT_EQ(files.size(), 4U);  // 240 kB each
  v1::CapturedQuery newest;
  std::ifstream file(files.back(), std::ios::binary);
  ASSERT_TRUE(newest.ParseFromIstream(&file));
  EXPECT_EQ(newest.request().scan().num_points(), 20'002U);
}

// Of what the bound allows in bytes, small files take many times as much in blocks.
TEST_F(CaptureTest, BoundsWhatSmallFilesTakeOfTheDisk) {
  ServerOptions options = Capturing();
  options.max_capture_bytes = 1 << 20;
  for (int i = 0; i < 600; ++i) dir_.Write(std::to_string(i + 1000) + ".query", "small");
  Start(options);
  ASSERT_TRUE(Ask(Lost()).ok());
  server_.reset();
  EXPECT_LE(DiskBytes(Files()), 1 << 20);
  EXPECT_GT(Files().size(), 200U);
}

TEST(QueryCapture, SaysThatTheDiskIsTooSlow) {
  testing::internal::CaptureStdout();  // the log, as long as no program has set it up
  {
    const test::TempDir dir;
    Metrics metrics([] { return Metrics::Gauges{}; });
    auto capture = *QueryCapture::Open(dir.path(), 1 << 30, metrics);
    v1::CapturedQuery query;
    query.mutable_request()->mutable_scan()->set_xyz_f32le(std::string(4 << 20, 'x'));
    std::vector<v1::CapturedQuery> queries(32, query);
    for (v1::CapturedQuery& each : queries) capture->Keep(std::move(each));
  }
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("too slow"));
}

TEST_F(CaptureTest, LeavesOthersFilesAloneAndRemovesUnfinishedOnes) {
  const std::string theirs = dir_.File("notes.txt");
  std::ofstream(theirs) << "mine";
  const std::string unfinished = dir_.File("20260101T000000.000Z-000000-x.query.part");
  std::ofstream(unfinished) << "half";
  Start(Capturing());
  EXPECT_TRUE(std::filesystem::exists(theirs));
  EXPECT_FALSE(std::filesystem::exists(unfinished));
}

TEST_F(CaptureTest, MakesItsFolderAndRefusesOneThatCannotBe) {
  ServerOptions options = Options();
  options.capture_dir = dir_.File("missing/captures");
  Start(options);
  ASSERT_TRUE(Ask(Lost()).ok());
  server_.reset();
  EXPECT_EQ(std::filesystem::status(options.capture_dir).permissions(),
            std::filesystem::perms::owner_all);
  EXPECT_FALSE(std::filesystem::is_empty(options.capture_dir));

  options.capture_dir = dir_.Write("file", "no folder");
  const auto server = Server::Start(options, test::LoaderOf(maps_));
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(server.status().message()), HasSubstr(options.capture_dir));
}

}  // namespace
}  // namespace scanloc::server

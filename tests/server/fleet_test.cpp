// Three workers that fetch their maps, behind the balancer of docker/haproxy-workers.cfg: one is
// killed, one loses its store and falls behind, a map is withdrawn, and robots go on asking.
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>

#include "front/listen_sockets.hpp"
#include "metered_scanlocd.hpp"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/catalogue/store.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "support/postgres.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kHaproxy = "/usr/sbin/haproxy";
constexpr int kNumRegions = 6;
/// A robot's, between calls: the balancer takes 500 a second from one address, and these share one.
constexpr std::chrono::milliseconds kPace(5);
/// What was withdrawn is answered from for no longer than this.
constexpr std::chrono::seconds kWithdrawn(5 * kSanitizerFactor);

class FleetTest : public ScanlocdTest {
 protected:
  void SetUp() override {
    if (!test::Postgres::IsInstalled() || !fs::exists(kHaproxy)) {
      GTEST_SKIP() << "PostgreSQL 15 or HAProxy is not installed";
    }
    database_ = std::make_unique<test::Postgres>();
    fs::create_directories(folder_);
    for (int i = 0; i < 2; ++i) {
      stores_.push_back(std::make_unique<test::Process>(std::vector<std::string>{
          "/usr/bin/python3", test::SourceDir() + "/tests/support/web_store.py", folder_}));
      store_urls_.push_back("http://127.0.0.1:" + stores_.back()->ReadLine());
    }
  }

  void Publish(const std::string& region, std::uint64_t seed) {
    const std::string path = WriteMap("of-" + std::to_string(seed), seed);
    const double x_m = 1e6 * static_cast<double>(seed);
    const catalogue::Version version{.region = region,
                                     .content_id = mapdb::ReadInfo(path)->content_id,
                                     .sha256 = *catalogue::Sha256OfFile(path),
                                     .num_bytes = static_cast<std::int64_t>(fs::file_size(path)),
                                     .num_places = kNumPlaces,
                                     .area = {.corners = {{x_m, 0}}}};
    ASSERT_TRUE((*catalogue::OpenStore(folder_))->Put(version.FileName(), path).ok());
    ASSERT_TRUE((*catalogue::OpenCatalogue(database_->Url()))->Publish(version).ok());
    const std::lock_guard lock(mutex_);
    allowed_[region].push_back(version.content_id);
  }

  void StartWorkers() {
    for (int i = 0; i < 3; ++i) {
      workers_.push_back(std::make_unique<test::Process>(
          Command({"--catalogue", database_->Url(), "--store", store_urls_[i == 2 ? 1 : 0],
                   "--cache-dir", files_.File("cache-" + std::to_string(i)), "--listen",
                   "127.0.0.1:0"}),
          test::ProcessOptions{.stderr_path = files_.File("log-" + std::to_string(i))}));
    }
    for (const auto& worker : workers_) {
      const std::string line = worker->ReadLine();
      ASSERT_THAT(line, testing::StartsWith("scanlocd ready on "));
      addresses_.push_back(line.substr(std::string("scanlocd ready on ").size()));
    }
  }

  void StartBalancer() {
    const auto listening = ListenAt("127.0.0.1:0").value();
    for (const int socket : listening.sockets) close(socket);
    address_ = listening.own_address;
    balancer_ = std::make_unique<test::Process>(
        std::vector<std::string>{kHaproxy, "-db", "-f",
                                 test::SourceDir() + "/docker/haproxy-workers.cfg"},
        test::ProcessOptions{
            .stdout_path = files_.Write("balancer", ""),
            .merge_stderr = true,
            .environment = {"LISTEN=" + address_, "WORKER_1=" + addresses_[0],
                            "WORKER_2=" + addresses_[1], "WORKER_3=" + addresses_[2]}});
    Await("the balancer listens",
          [&] { return client::Client::Connect({.address = address_}).ok(); });
  }

  /// Asks until there is an answer; false where there is none for as long as a robot waits.
  bool IsAnswered(const client::Client& robot, const std::string& region) {
    const auto end = Clock::now() + test::Process::kPatience / 2;
    while (Clock::now() < end) {
      std::this_thread::sleep_for(kPace);
      const auto reply = robot.LocalizeScan(test::QueryScan(1, 2), {.map = region});
      if (reply.ok()) {
        const std::lock_guard lock(mutex_);
        const auto& allowed = allowed_[region];
        EXPECT_TRUE(std::find(allowed.begin(), allowed.end(), reply->answer.content_id) !=
                    allowed.end());
        return true;
      }
      EXPECT_TRUE(absl::IsUnavailable(reply.status()) || absl::IsNotFound(reply.status()))
          << reply.status();
      if (absl::IsNotFound(reply.status())) return false;
    }
    return false;
  }

  test::TempDir files_;
  std::string folder_ = files_.File("store");
  std::unique_ptr<test::Postgres> database_;
  std::vector<std::unique_ptr<test::Process>> stores_;
  std::vector<std::string> store_urls_;
  std::vector<std::unique_ptr<test::Process>> workers_;
  std::vector<std::string> addresses_;
  std::unique_ptr<test::Process> balancer_;
  std::mutex mutex_;
  std::map<std::string, std::vector<std::string>> allowed_;  // content ids, by region
};

std::string RegionOf(int i) { return "region-" + std::to_string(i); }

TEST_F(FleetTest, LosesNoQueryAndAnswersFromNoMapThatWasWithdrawn) {
  for (int i = 0; i < kNumRegions; ++i) Publish(RegionOf(i), static_cast<std::uint64_t>(i) + 1);
  StartWorkers();
  StartBalancer();
  for (int i = 0; i < kNumRegions; ++i) EXPECT_TRUE(IsAnswered(Connect(), RegionOf(i))) << i;

  // The last region is withdrawn later; the others are asked about all the time.
  std::atomic<int> num_answered = 0;
  std::vector<std::jthread> robots;
  for (int t = 0; t < 2; ++t) {
    robots.emplace_back([&, t](const std::stop_token& is_over) {
      const client::Client robot = Connect();
      for (int i = t; !is_over.stop_requested(); ++i) {
        const std::string region = RegionOf(i % (kNumRegions - 1));
        EXPECT_TRUE(IsAnswered(robot, region)) << region;
        ++num_answered;
      }
    });
  }
  const auto await_answers = [&](int count) {
    Await("robots are answered",
          [&, before = num_answered.load()] { return num_answered > before + count; });
  };
  await_answers(50);
  workers_[0]->Signal(SIGKILL);
  workers_[0]->Wait();
  await_answers(50);
  stores_[1]->Signal(SIGKILL);  // the third worker's
  stores_[1]->Wait();
  Publish(RegionOf(0), 20);
  await_answers(100);

  const std::string last = RegionOf(kNumRegions - 1);
  ASSERT_TRUE((*catalogue::OpenCatalogue(database_->Url()))->Withdraw(last).ok());
  const auto withdrawn_at = Clock::now();
  const client::Client robot = Connect();
  Await("the map is withdrawn", [&] {
    std::this_thread::sleep_for(kPace);
    return absl::IsNotFound(robot.LocalizeScan(test::QueryScan(1, 2), {.map = last}).status());
  });
  EXPECT_LT(Clock::now() - withdrawn_at, kWithdrawn);
  while (Clock::now() - withdrawn_at < kWithdrawn) std::this_thread::yield();
  for (std::size_t i = 1; i < workers_.size(); ++i) {  // each worker, whoever has its calls
    const auto direct = *client::Client::Connect({.address = addresses_[i]});
    EXPECT_FALSE(direct.LocalizeScan(test::QueryScan(1, 2), {.map = last}).ok());
  }
  await_answers(50);
  robots.clear();
  for (std::size_t i = 1; i < workers_.size(); ++i) {
    workers_[i]->Signal(SIGTERM);
    EXPECT_EQ(workers_[i]->Wait(), 0);
  }
}

}  // namespace
}  // namespace scanloc::server

// A real server that is asked for more than it can answer, by arrivals that do not wait for it.
#include <algorithm>
#include <atomic>
#include <iostream>

#include "metered_scanlocd.hpp"
#include "support/load.hpp"
#include "support/long_tests.hpp"

namespace scanloc::server {
namespace {

using bench::LoadOptions;
using bench::LoadResult;
using grpc::StatusCode;

constexpr double kMemoryBytes = 256.0 * 1024 * 1024;
#ifdef SCANLOC_SANITIZED
// What was freed stays in quarantine for a while.
constexpr double kMoreMemoryBytes = 4 * kMemoryBytes;
#else
constexpr double kMoreMemoryBytes = kMemoryBytes;
#endif

/// Highest value of a metric while it lives.
class Watermark {
 public:
  explicit Watermark(std::function<double()> look)
      : thread_([this, look = std::move(look)] {
          while (!is_over_) {
            highest_ = std::max(highest_.load(), look());
            std::this_thread::sleep_for(std::chrono::milliseconds(50));  // it is the server's CPU
          }
        }) {}
  double End() {
    is_over_ = true;
    thread_.join();
    return highest_;
  }

 private:
  std::atomic<bool> is_over_ = false;
  std::atomic<double> highest_ = 0.0;
  std::thread thread_;
};

std::vector<grpc::ByteBuffer> Queries() {
  std::vector<grpc::ByteBuffer> requests;
  for (int place = 0; place < kNumPlaces; ++place) {
    const std::string bytes = test::ScanRequest(test::QueryScan(1, place)).SerializeAsString();
    const grpc::Slice slice(bytes);
    requests.emplace_back(&slice, 1);
  }
  return requests;
}

double Median(const LoadResult& result, StatusCode code) {
  const auto& times_ms = result.times_ms.at(code);
  return times_ms[times_ms.size() / 2];
}

class OverloadTest : public MeteredScanlocdTest {
 protected:
  static void ExpectAnsweredOrTold(const LoadResult& result) {
    for (const auto& [code, times_ms] : result.times_ms) {
      EXPECT_TRUE(code == StatusCode::OK || code == StatusCode::RESOURCE_EXHAUSTED)
          << times_ms.size() << " calls ended with code " << code;
    }
    EXPECT_EQ(result.num_without_retry_after, 0U);
    EXPECT_GT(result.Count(StatusCode::OK), 0U);
  }
};

TEST_F(OverloadTest, AnswersWhatItCanTellsTheOthersAndIsItselfAfterwards) {
  StartMetered({"--map", "town=" + WriteMap("town", 1), "--log-requests", "none"});
  const std::vector<grpc::ByteBuffer> requests = Queries();
  const auto load = [&](double seconds, double rate_per_s) {
    return bench::RunLoad({.address = address_,
                           .seconds = seconds,
                           .rate_per_s = rate_per_s,
                           .num_inflight = 4,
                           .deadline_s = 60.0},
                          requests);
  };
  const LoadResult most = load(1.0, 0.0);
  ExpectAnsweredOrTold(most);
  const double memory_before = Metric("process_resident_memory_bytes");
  const double threads_before = Metric("process_threads");

  Watermark memory([this] { return Metric("process_resident_memory_bytes"); });
  const double seconds = test::LongTests() ? 60.0 : 5.0;
  // Were the machine busy with something else just now, twice what it did would be no overload.
  double rate_per_s = 2.0 * most.PerSecond(StatusCode::OK);
  LoadResult over = load(seconds, rate_per_s);
  for (int i = 0; i < 3 && over.Count(StatusCode::RESOURCE_EXHAUSTED) == 0; ++i) {
    rate_per_s *= 2.0;
    over = load(seconds, rate_per_s);
  }
  const double highest = memory.End();
  ExpectAnsweredOrTold(over);
  ASSERT_GT(over.Count(StatusCode::RESOURCE_EXHAUSTED), 0U) << "it was not overloaded";
  EXPECT_LT(highest, memory_before + kMoreMemoryBytes);
  EXPECT_LE(Metric("process_threads"), threads_before + 16);
  std::cout << "most " << most.PerSecond(StatusCode::OK) << "/s, asked for " << rate_per_s
            << "/s: accepted " << over.PerSecond(StatusCode::OK) << "/s, median "
            << Median(over, StatusCode::OK) << " ms (calm: " << Median(most, StatusCode::OK)
            << "), refused " << over.PerSecond(StatusCode::RESOURCE_EXHAUSTED) << "/s, median "
            << Median(over, StatusCode::RESOURCE_EXHAUSTED) << " ms; memory "
            << memory_before / (1 << 20) << ", at most " << highest / (1 << 20) << " MiB\n";

  // Nothing is left of it: one question at a time is never refused.
  AwaitMetric("scanloc_in_flight", [](double value) { return value == 0.0; });
  EXPECT_EQ(Metric("scanloc_queue_depth"), 0.0);
  const auto client = client::Client::Connect({.address = address_, .retry = {.max_attempts = 1}});
  ASSERT_TRUE(client.ok()) << client.status();
  for (int i = 0; i < 200; ++i) {
    const int place = i % kNumPlaces;
    const auto reply = client->LocalizeScan(test::QueryScan(1, place));
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->answer.candidates.front().place, place);
  }
  ExpectStopsWell();
}

}  // namespace
}  // namespace scanloc::server

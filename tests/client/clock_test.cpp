// The time of day is set while a robot waits for an answer.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "scanloc/client/client.hpp"
#include "scanloc/v1/localization.grpc.pb.h"

namespace {

std::atomic<std::int64_t> shift_s = 0;

}  // namespace

/// What every library of this program asks for the time: the time of day is off by shift_s.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (clock == CLOCK_REALTIME) time->tv_sec += shift_s;
  return result;
}

namespace scanloc::client {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

constexpr milliseconds kTimeout(20'000);

/// Has its clock set while it looks at the first query, to which it has no answer.
class ClockTest : public testing::Test, private v1::Localization::Service {
 protected:
  ClockTest() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
    options_.address = "127.0.0.1:" + std::to_string(port);
    options_.timeout = kTimeout;
    options_.retry.initial_backoff = milliseconds(1);
  }
  ~ClockTest() override {
    server_->Shutdown();
    shift_s = 0;
  }

  /// Asks once, while the clock is set by so much.
  [[nodiscard]] absl::Status AskWhileSetBy(hours step) {
    step_ = step;
    const auto client = Client::Connect(options_);
    if (!client.ok()) return client.status();
    return client->LocalizeScan(PointCloud{{1.0F, 2.0F, 3.0F}}).status();
  }

  /// Of each call's time, at its arrival.
  [[nodiscard]] std::vector<std::chrono::system_clock::duration> left() const {
    const std::lock_guard lock(mutex_);
    return left_;
  }

 private:
  grpc::Status Localize(grpc::ServerContext* context, const v1::LocalizeRequest*,
                        v1::LocalizeResponse* response) override {
    const std::lock_guard lock(mutex_);
    left_.push_back(context->deadline() - std::chrono::system_clock::now());
    if (left_.size() == 1) {
      shift_s += std::chrono::seconds(step_.load()).count();
      return {grpc::StatusCode::UNAVAILABLE, "the clock is being set"};
    }
    response->set_outcome(v1::OUTCOME_NOT_RECOGNIZED);
    return grpc::Status::OK;
  }

  std::atomic<hours> step_ = hours(0);
  mutable std::mutex mutex_;
  std::vector<std::chrono::system_clock::duration> left_;
  ClientOptions options_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(ClockTest, AsksAgainThoughTheClockIsSetForward) {
  const absl::Status status = AskWhileSetBy(hours(1));
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(left().size(), 2U);
}

TEST_F(ClockTest, WaitsNoLongerThoughTheClockIsSetBack) {
  const absl::Status status = AskWhileSetBy(hours(-1));
  EXPECT_TRUE(status.ok()) << status;
  ASSERT_EQ(left().size(), 2U);
  // As much as the call had in all, give or take what gRPC rounds.
  for (const auto time : left()) EXPECT_LE(time, kTimeout + milliseconds(1000));
}

}  // namespace
}  // namespace scanloc::client

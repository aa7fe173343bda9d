// The client before a server that does not always answer.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "scanloc/client/client.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/admin.grpc.pb.h"
#include "scanloc/v1/localization.grpc.pb.h"

namespace scanloc::client {
namespace {

using std::chrono::milliseconds;

/// Fails so many calls before it answers.
class ShakyServer : public v1::Localization::Service, public v1::Admin::Service {
 public:
  ShakyServer(int num_failures, absl::Status failure)
      : num_failures_(num_failures), failure_(std::move(failure)) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(static_cast<v1::Localization::Service*>(this));
    builder.RegisterService(static_cast<v1::Admin::Service*>(this));
    server_ = builder.BuildAndStart();
    address_ = "127.0.0.1:" + std::to_string(port);
  }

  grpc::Status Localize(grpc::ServerContext* context, const v1::LocalizeRequest*,
                        v1::LocalizeResponse* response) override {
    const auto id = context->client_metadata().find("x-request-id");
    const std::lock_guard lock(mutex_);
    ids_.push_back(id == context->client_metadata().end()
                       ? ""
                       : std::string(id->second.data(), id->second.size()));
    response->set_outcome(v1::OUTCOME_NOT_RECOGNIZED);
    return Next();
  }
  grpc::Status ListMaps(grpc::ServerContext*, const v1::ListMapsRequest*,
                        v1::ListMapsResponse*) override {
    return Next();
  }
  grpc::Status UnloadMap(grpc::ServerContext*, const v1::UnloadMapRequest*,
                         v1::UnloadMapResponse*) override {
    return Next();
  }

  [[nodiscard]] Client Connect(const RetryOptions& retry) const {
    ClientOptions options{.address = address_};
    options.retry = retry;
    return *Client::Connect(options);
  }
  [[nodiscard]] int num_calls() const { return num_calls_; }
  [[nodiscard]] std::vector<std::string> ids() const {
    const std::lock_guard lock(mutex_);
    return ids_;
  }

 private:
  grpc::Status Next() {
    return num_calls_++ < num_failures_ ? proto::ToGrpc(failure_) : grpc::Status::OK;
  }

  const int num_failures_;
  const absl::Status failure_;
  std::atomic<int> num_calls_ = 0;
  mutable std::mutex mutex_;
  std::vector<std::string> ids_;  // of queries, in turn
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

const RetryOptions kQuick{
    .max_attempts = 4, .initial_backoff = milliseconds(1), .max_backoff = milliseconds(2)};
const PointCloud kScan = {{1.0F, 2.0F, 3.0F}};

TEST(Retry, SendsTheRequestIdWithEveryAttempt) {
  ShakyServer server(1, absl::UnavailableError("restarting"));
  const Client client = server.Connect(kQuick);
  EXPECT_TRUE(client.LocalizeScan(kScan, {.request_id = "robot-7/42"}).ok());
  EXPECT_TRUE(client.LocalizeScan(kScan).ok());
  EXPECT_THAT(server.ids(), testing::ElementsAre("robot-7/42", "robot-7/42", ""));
  for (const std::string& bad : {std::string("two words"), std::string(129, 'x')}) {
    EXPECT_EQ(client.LocalizeScan(kScan, {.request_id = bad}).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST(Retry, AsksAgainUntilThereIsAnAnswer) {
  for (const absl::Status& failure :
       {absl::UnavailableError("restarting"),
        proto::WithRetryAfter(absl::ResourceExhaustedError("busy"), 0.001)}) {
    ShakyServer server(3, failure);
    const Client client = server.Connect(kQuick);
    EXPECT_TRUE(client.LocalizeScan(kScan).ok());
    EXPECT_EQ(server.num_calls(), 4);
  }
  ShakyServer server(2, absl::UnavailableError("restarting"));
  EXPECT_TRUE(server.Connect(kQuick).ListMaps().ok());
  EXPECT_EQ(server.num_calls(), 3);
}

TEST(Retry, GivesUpAfterItsAttemptsWithTheServersOwnWords) {
  ShakyServer server(1000, absl::UnavailableError("draining, sorry"));
  const absl::Status status = server.Connect(kQuick).LocalizeScan(kScan).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("draining, sorry"));
  EXPECT_EQ(server.num_calls(), 4);
}

TEST(Retry, DoesNotWaitBeyondTheTimeoutOfTheCall) {
  ShakyServer server(1000, proto::WithRetryAfter(absl::ResourceExhaustedError("busy"), 30.0));
  const Client client = server.Connect(kQuick);
  RequestOptions options;
  options.timeout = std::chrono::seconds(10);
  const absl::Status status = client.LocalizeScan(kScan, options).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(server.num_calls(), 1);
  EXPECT_EQ(proto::RetryAfter(status), 30.0) << "so that the caller may plan";
}

TEST(Retry, NeverRepeatsWhatIsNotSafeOrWouldNotHelp) {
  {
    ShakyServer server(1000, absl::UnavailableError("restarting"));
    EXPECT_FALSE(server.Connect(kQuick).UnloadMap("town").ok());
    EXPECT_EQ(server.num_calls(), 1);
  }
  for (const absl::Status& failure :
       {absl::InvalidArgumentError("no"), absl::ResourceExhaustedError("too large"),
        absl::DeadlineExceededError("late"), absl::InternalError("broken")}) {
    ShakyServer server(1000, failure);
    EXPECT_EQ(server.Connect(kQuick).LocalizeScan(kScan).status().code(), failure.code());
    EXPECT_EQ(server.num_calls(), 1);
  }
}

TEST(Retry, OptionsAreChecked) {
  ClientOptions options;
  EXPECT_TRUE(Validate(options).ok());
  options.retry.max_attempts = 0;
  EXPECT_FALSE(Validate(options).ok());
  options.retry = {
      .max_attempts = 3, .initial_backoff = milliseconds(100), .max_backoff = milliseconds(10)};
  EXPECT_FALSE(Validate(options).ok());
}

}  // namespace
}  // namespace scanloc::client

#include "rpc/health_service.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using grpc::health::v1::Health;
using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

/// A Watch stream that is read as the test goes on.
class Watch {
 public:
  Watch(Health::Stub& stub, const std::string& service) {
    HealthCheckRequest request;
    request.set_service(service);
    test::SetPatience(context_);
    reader_ = stub.Watch(&context_, request);
  }

  /// The next status told; UNKNOWN once the stream has ended.
  HealthCheckResponse::ServingStatus Next() {
    HealthCheckResponse response;
    return reader_->Read(&response) ? response.status() : HealthCheckResponse::UNKNOWN;
  }

  void Cancel() { context_.TryCancel(); }
  grpc::Status Finish() { return reader_->Finish(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<HealthCheckResponse>> reader_;
};

HealthCheckResponse::ServingStatus Check(Health::Stub& stub, const std::string& service) {
  grpc::ClientContext context;
  test::SetPatience(context);
  HealthCheckRequest request;
  request.set_service(service);
  HealthCheckResponse response;
  const grpc::Status status = stub.Check(&context, request, &response);
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
    return HealthCheckResponse::SERVICE_UNKNOWN;
  }
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.status();
}

TEST(HealthService, ServesEachMapOnceItIsLoadedAndAllOnceAllAre) {
  const test::Maps maps = {{"a", test::SmallMap(1, 3)}, {"b", test::SmallMap(2, 3)}};
  test::Gate may_load_b;
  const auto load = test::LoaderOf(maps);
  auto server =
      Server::Start(test::OptionsFor(maps), [&](const std::string& path, const Map* before) {
        if (path == "b") may_load_b.Wait();
        return load(path, before);
      });
  ASSERT_TRUE(server.ok()) << server.status();
  const auto channel = test::ChannelTo((*server)->address());
  const auto stub = Health::NewStub(channel);
  for (const std::string& service : {std::string(), HealthName("a"), HealthName("b")}) {
    EXPECT_EQ(Check(*stub, service), HealthCheckResponse::NOT_SERVING) << service;
  }
  Watch all(*stub, "");
  Watch a(*stub, HealthName("a"));
  Watch b(*stub, HealthName("b"));
  EXPECT_EQ(all.Next(), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(a.Next(), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(b.Next(), HealthCheckResponse::NOT_SERVING);

  std::thread loader([&] { EXPECT_TRUE((*server)->LoadMaps().ok()); });
  EXPECT_EQ(a.Next(), HealthCheckResponse::SERVING);
  EXPECT_EQ(Check(*stub, HealthName("b")), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(Check(*stub, ""), HealthCheckResponse::NOT_SERVING);
  const auto localization = v1::Localization::NewStub(channel);
  v1::LocalizeResponse response;
  EXPECT_TRUE(
      test::Localize(*localization, test::ScanRequest(test::QueryScan(1, 0), "a"), &response).ok());
  EXPECT_EQ(test::Localize(*localization, test::ScanRequest(test::QueryScan(2, 0), "b"), &response)
                .error_code(),
            grpc::StatusCode::UNAVAILABLE);

  may_load_b.Open();
  EXPECT_EQ(b.Next(), HealthCheckResponse::SERVING);
  EXPECT_EQ(all.Next(), HealthCheckResponse::SERVING);
  loader.join();
  EXPECT_EQ(Check(*stub, ""), HealthCheckResponse::SERVING);
}

TEST(HealthService, TellsWatchersOfTheDrainAndLetsThemGo) {
  const test::Maps maps = {{"a", test::SmallMap(1, 3)}};
  const auto server = test::StartServer(maps);
  const auto stub = Health::NewStub(test::ChannelTo(server->address()));
  Watch all(*stub, "");
  Watch a(*stub, HealthName("a"));
  EXPECT_EQ(all.Next(), HealthCheckResponse::SERVING);
  EXPECT_EQ(a.Next(), HealthCheckResponse::SERVING);
  std::thread stopper([&] { server->Shutdown(); });
  EXPECT_EQ(all.Next(), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(a.Next(), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(all.Next(), HealthCheckResponse::UNKNOWN);
  EXPECT_EQ(all.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  stopper.join();
}

TEST(HealthService, DoesNotKnowWhatIsNoMap) {
  const auto server = test::StartServer({{"a", test::SmallMap(1, 3)}});
  const auto stub = Health::NewStub(test::ChannelTo(server->address()));
  EXPECT_EQ(Check(*stub, HealthName("b")), HealthCheckResponse::SERVICE_UNKNOWN);
  EXPECT_EQ(Check(*stub, std::string(100'000, 'x')), HealthCheckResponse::SERVICE_UNKNOWN);
  Watch strange(*stub, std::string(100'000, 'x'));
  EXPECT_EQ(strange.Next(), HealthCheckResponse::SERVICE_UNKNOWN);
  strange.Cancel();
  EXPECT_FALSE(strange.Finish().ok());
}

TEST(HealthService, OutlivesWatchersThatHangUp) {
  const auto server = test::StartServer({{"a", test::SmallMap(1, 3)}});
  const auto stub = Health::NewStub(test::ChannelTo(server->address()));
  for (int i = 0; i < 50; ++i) {
    Watch watch(*stub, "");
    if (i % 2 == 0) {
      EXPECT_EQ(watch.Next(), HealthCheckResponse::SERVING);
    }
    watch.Cancel();
    EXPECT_FALSE(watch.Finish().ok());
  }
  EXPECT_EQ(Check(*stub, ""), HealthCheckResponse::SERVING);
}

TEST(HealthService, TakesNoMoreWatchersThanItsLimit) {
  const auto server = test::StartServer({{"a", test::SmallMap(1, 3)}});
  const auto stub = Health::NewStub(test::ChannelTo(server->address()));
  std::vector<std::unique_ptr<Watch>> watches;
  for (int i = 0; i < HealthService::kMaxWatchersOfAddress; ++i) {
    watches.push_back(std::make_unique<Watch>(*stub, ""));
    ASSERT_EQ(watches.back()->Next(), HealthCheckResponse::SERVING);
  }
  {
    Watch another(*stub, "");
    EXPECT_EQ(another.Next(), HealthCheckResponse::UNKNOWN);
    EXPECT_EQ(another.Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  EXPECT_EQ(Check(*stub, ""), HealthCheckResponse::SERVING);
  // One that goes makes room; when the server learns of it is not ours to say.
  watches.front()->Cancel();
  EXPECT_FALSE(watches.front()->Finish().ok());
  for (bool is_watching = false; !is_watching;) {
    Watch next(*stub, "");
    is_watching = next.Next() == HealthCheckResponse::SERVING;
    next.Cancel();
    std::ignore = next.Finish();
  }
  for (std::size_t i = 1; i < watches.size(); ++i) {
    watches[i]->Cancel();
    std::ignore = watches[i]->Finish();
  }
}

}  // namespace
}  // namespace scanloc::server

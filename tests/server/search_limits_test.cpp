// What a search may cost a server, and that it ends when nobody waits for it any more.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "rpc/localization_service.hpp"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

/// A map in which a slow search lasts long enough to be broken off.
Map LargeMap() {
  Map map = test::SmallMap(1, 4);
  const Map small = map;
  auto describer = Describer::Create(map.params).value();
  const PlaceDescriptor descriptor = describer.DescribePlace(test::PlaceScan(1, 0));
  for (int i = 0; i < 3000; ++i) {
    map.places.push_back(small.places[0]);
    map.AppendDescriptor(static_cast<int>(map.places.size()) - 1, descriptor);
  }
  return map;
}

class SearchTest : public testing::Test {
 protected:
  void StartWith(bool allow_slow_methods, int max_candidates = 1000,
                 Map map = test::SmallMap(1, 4)) {
    const test::Maps maps = {{"town", std::move(map)}};
    ServerOptions options = test::OptionsFor(maps);
    options.allow_slow_methods = allow_slow_methods;
    options.max_candidates = max_candidates;
    server_ = test::StartServer(maps, options);
    stub_ = v1::Localization::NewStub(test::ChannelTo(server_->address()));
  }

  static v1::LocalizeRequest SlowRequest() {
    v1::LocalizeRequest request = test::ScanRequest(test::QueryScan(1, 2));
    request.mutable_options()->set_method(v1::METHOD_A_PC);
    request.mutable_options()->set_naive_alignment(true);
    request.mutable_options()->set_brute_force(true);
    return request;
  }

  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::Localization::Stub> stub_;
  v1::LocalizeResponse response_;
};

TEST_F(SearchTest, TakesSlowMethodsOnlyIfToldTo) {
  StartWith(/*allow_slow_methods=*/false);
  for (const auto& [naive, brute] : {std::pair(false, true), {true, false}, {true, true}}) {
    v1::LocalizeRequest request = SlowRequest();
    request.mutable_options()->set_naive_alignment(naive);
    request.mutable_options()->set_brute_force(brute);
    const grpc::Status status = test::Localize(*stub_, request, &response_);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(status.error_message(), HasSubstr("--allow-slow-methods"));
  }
  StartWith(/*allow_slow_methods=*/true);
  EXPECT_TRUE(test::Localize(*stub_, SlowRequest(), &response_).ok());
}

TEST_F(SearchTest, TakesNoMoreCandidatesThanTheLimit) {
  StartWith(false, 3);
  v1::LocalizeRequest request = test::ScanRequest(test::QueryScan(1, 2));
  EXPECT_TRUE(test::Localize(*stub_, request, &response_).ok());
  request.mutable_options()->set_num_candidates(4);
  EXPECT_EQ(test::Localize(*stub_, request, &response_).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST(LimitCandidates, HoldsTheMapsOwnChoiceToTheLimit) {
  Params params;
  params.search.num_candidates = 10;
  struct Case {
    const char* method;
    int limit;
    std::optional<int> expected;
  };
  for (const Case& c : std::vector<Case>{{"a-pc", 10, std::nullopt},
                                         {"a-pc", 9, 9},
                                         {"auto", 100, std::nullopt},
                                         {"auto", 99, 99}}) {
    Query query;
    query.method = ParseMethod(c.method).value();
    LimitCandidates(params, c.limit, query);
    EXPECT_EQ(query.num_candidates, c.expected) << c.method << " " << c.limit;
    query.num_candidates = 5;
    LimitCandidates(params, c.limit, query);
    EXPECT_EQ(query.num_candidates, 5);
  }
}

TEST_F(SearchTest, EndsWhenItsCallerHangsUp) {
  StartWith(true, 1000, LargeMap());
  grpc::ClientContext context;
  test::SetPatience(context);
  const v1::LocalizeRequest request = SlowRequest();
  std::thread caller([&] { std::ignore = stub_->Localize(&context, request, &response_); });
  while (server_->workers().load().num_running == 0) std::this_thread::yield();
  context.TryCancel();
  caller.join();
  while (server_->workers().load().num_running > 0) std::this_thread::yield();
  EXPECT_THAT(server_->MetricsText(), HasSubstr("code=\"CANCELLED\",map=\"\",method=\"Localize\""));
}

TEST_F(SearchTest, EndsWhenItsDeadlinePasses) {
  StartWith(true, 1000, LargeMap());
  // How long a query takes to get to its search is not known: the first deadline that does it.
  std::chrono::milliseconds patience(1);
  while (server_->MetricsText().find("code=\"CANCELLED\",map=\"\",method=\"Localize\"") ==
         std::string::npos) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    ASSERT_EQ(stub_->Localize(&context, SlowRequest(), &response_).error_code(),
              grpc::StatusCode::DEADLINE_EXCEEDED);
    while (server_->workers().load().num_running > 0) std::this_thread::yield();
    patience += std::chrono::milliseconds(2);
  }
}

}  // namespace
}  // namespace scanloc::server

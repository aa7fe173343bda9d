#include "scanloc/server/server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

/// Queries under way, told apart by the order in which they end.
class AsyncCalls {
 public:
  explicit AsyncCalls(const std::string& address)
      : stub_(v1::Localization::NewStub(test::ChannelTo(address))) {}

  /// Every callback must have run.
  ~AsyncCalls() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return num_ended_ == calls_.size(); });
  }

  struct Call {
    grpc::ClientContext context;
    v1::LocalizeRequest request;
    v1::LocalizeResponse response;
  };
  struct Ended {
    Call* call;
    grpc::Status status;
  };

  Call& Start(std::chrono::milliseconds timeout = std::chrono::seconds(60)) {
    Call& call = calls_.emplace_back();
    call.context.set_deadline(std::chrono::system_clock::now() + timeout);
    call.request = test::ScanRequest(test::QueryScan(1, 1));
    stub_->async()->Localize(&call.context, &call.request, &call.response,
                             [this, &call](const grpc::Status& status) {
                               const std::lock_guard lock(mutex_);
                               ended_.push_back({&call, status});
                               ++num_ended_;
                               changed_.notify_all();
                             });
    return call;
  }

  Ended AwaitOne() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !ended_.empty(); });
    const Ended ended = ended_.front();
    ended_.pop_front();
    return ended;
  }

 private:
  std::unique_ptr<v1::Localization::Stub> stub_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Call> calls_;
  std::deque<Ended> ended_;
  std::size_t num_ended_ = 0;
};

/// A server with one thread, which is kept busy until the gate opens, and room for one query to
/// wait behind it.
class BusyServer {
 public:
  explicit BusyServer(double drain_s = 60.0) {
    const test::Maps maps = {{"town", test::SmallMap(1, 4)}};
    ServerOptions options = test::OptionsFor(maps);
    options.num_threads = 1;
    options.max_inflight = 2;
    options.drain_s = drain_s;
    server_ = test::StartServer(maps, options);
    calls_.emplace(server_->address());
    EXPECT_TRUE(server_->workers()
                    .Submit("test", [this](const absl::StatusOr<int>&) { gate_.Wait(); })
                    .ok());
  }
  ~BusyServer() { gate_.Open(); }

  /// Starts a query and returns it once it waits for the thread: two are started, of which the
  /// server must refuse the later at once.
  AsyncCalls::Call& StartOneThatWaits() {
    AsyncCalls::Call& first = calls_->Start();
    AsyncCalls::Call& second = calls_->Start();
    const AsyncCalls::Ended refused = calls_->AwaitOne();
    EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << refused.status.error_message();
    EXPECT_THAT(refused.status.error_message(), HasSubstr("busy with 2 queries"));
    return refused.call == &first ? second : first;
  }

  [[nodiscard]] Server& server() { return *server_; }
  [[nodiscard]] AsyncCalls& calls() { return *calls_; }
  void Open() { gate_.Open(); }

 private:
  test::Gate gate_;
  std::unique_ptr<Server> server_;
  std::optional<AsyncCalls> calls_;
};

TEST(Server, RefusesAtOnceWhatItCannotQueue) {
  BusyServer busy;
  const AsyncCalls::Call& waiting = busy.StartOneThatWaits();
  busy.Open();
  const AsyncCalls::Ended ended = busy.calls().AwaitOne();
  EXPECT_EQ(ended.call, &waiting);
  EXPECT_TRUE(ended.status.ok()) << ended.status.error_message();
  EXPECT_EQ(waiting.response.candidates(0).place(), 1);
  EXPECT_GT(waiting.response.times().queue_ns(), 0);
}

TEST(Server, FinishesWhatIsInFlightWhenStopped) {
  BusyServer busy;
  grpc::ClientContext context;
  test::SetPatience(context);
  const auto health = grpc::health::v1::Health::NewStub(test::ChannelTo(busy.server().address()));
  const auto watch = health->Watch(&context, {});
  grpc::health::v1::HealthCheckResponse told;
  ASSERT_TRUE(watch->Read(&told));

  const AsyncCalls::Call& waiting = busy.StartOneThatWaits();
  std::thread stopper([&] { busy.server().Shutdown(); });
  ASSERT_TRUE(watch->Read(&told));  // the drain has begun
  EXPECT_EQ(told.status(), grpc::health::v1::HealthCheckResponse::NOT_SERVING);
  busy.Open();
  const AsyncCalls::Ended ended = busy.calls().AwaitOne();
  EXPECT_EQ(ended.call, &waiting);
  EXPECT_TRUE(ended.status.ok()) << ended.status.error_message();
  stopper.join();
}

TEST(Server, CancelsWhatHasNotStartedWhenTheDrainTimeIsOver) {
  BusyServer busy(/*drain_s=*/0.01);
  busy.StartOneThatWaits();
  std::thread stopper([&] { busy.server().Shutdown(); });
  EXPECT_FALSE(busy.calls().AwaitOne().status.ok());
  busy.Open();
  stopper.join();
}

TEST(Server, AcceptsNothingOnceStopped) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, 4)}});
  server->Shutdown();
  const auto stub = v1::Localization::NewStub(test::ChannelTo(server->address()));
  v1::LocalizeResponse response;
  EXPECT_EQ(test::Localize(*stub, test::ScanRequest(test::QueryScan(1, 1)), &response).error_code(),
            grpc::StatusCode::UNAVAILABLE);
}

TEST(Server, OutlivesAClientThatCancelsInMidFlight) {
  BusyServer busy;
  AsyncCalls::Call& waiting = busy.StartOneThatWaits();
  waiting.context.TryCancel();
  EXPECT_EQ(busy.calls().AwaitOne().status.error_code(), grpc::StatusCode::CANCELLED);
  busy.Open();
  while (true) {  // the cancelled query may still hold its room
    busy.calls().Start();
    const grpc::Status status = busy.calls().AwaitOne().status;
    if (status.ok()) break;
    ASSERT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
}

TEST(Server, DoesNotAnswerAfterTheDeadline) {
  BusyServer busy;
  busy.calls().Start(std::chrono::milliseconds(30));
  EXPECT_EQ(busy.calls().AwaitOne().status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  busy.calls().Start(std::chrono::milliseconds(-1));
  EXPECT_EQ(busy.calls().AwaitOne().status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST(Server, TellsWhyTheFirstMapDoesNotLoadWhereNoneDoes) {
  const test::Maps maps = {{"a", test::SmallMap(1, 2)}, {"b", test::SmallMap(2, 2)}};
  const auto server = Server::Start(test::OptionsFor(maps),
                                    [](const std::string& path, const Map*) -> absl::StatusOr<Map> {
                                      return absl::DataLossError(path + " is torn");
                                    });
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_EQ((*server)->LoadMaps(), absl::DataLossError("map a: a is torn"));
}

TEST(Server, ServesTheMapsThatLoadAndTellsOfTheOthers) {
  const test::Maps maps = {{"a", test::SmallMap(1, 2)}, {"b", test::SmallMap(2, 2)}};
  bool is_torn = true;
  const auto server = Server::Start(
      test::OptionsFor(maps), [&](const std::string& path, const Map*) -> absl::StatusOr<Map> {
        if (path == "a" && is_torn) return absl::DataLossError("it is torn");
        return maps.at(path);
      });
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_TRUE((*server)->LoadMaps().ok());
  EXPECT_EQ((*server)->maps().List()[0].state, MapState::kFailed);
  EXPECT_EQ((*server)->maps().List()[1].state, MapState::kServing);
  EXPECT_THAT(std::string((*server)->maps().Find("a").status().message()),
              HasSubstr("could not be loaded"));
  EXPECT_EQ((*server)->ReloadMap("a"), absl::DataLossError("map a: it is torn"));
  EXPECT_EQ((*server)->ReloadMap("c").code(), absl::StatusCode::kNotFound);
  is_torn = false;
  EXPECT_TRUE((*server)->ReloadMap("a").ok());
  EXPECT_TRUE((*server)->maps().Find("a").ok());
}

TEST(Server, LeavesAMapThatIsUnchangedAsItIs) {
  Map map = test::SmallMap(1, 2);
  const auto server =
      Server::Start(test::OptionsFor({{"a", map}}),
                    [&](const std::string&, const Map*) -> absl::StatusOr<Map> { return map; });
  ASSERT_TRUE((*server)->LoadMaps().ok());
  EXPECT_TRUE((*server)->ReloadMap("a").ok());
  EXPECT_EQ((*server)->maps().List()[0].generation, 1U);
  map.calibration.num_trials = 7;  // calibrated since
  EXPECT_TRUE((*server)->ReloadMap("a").ok());
  EXPECT_EQ((*server)->maps().List()[0].generation, 2U);
}

TEST(Server, TurnsWhatALoaderThrowsIntoAStatus) {
  const test::Maps maps = {{"a", test::SmallMap(1, 2)}};
  const auto server = Server::Start(test::OptionsFor(maps),
                                    [](const std::string&, const Map*) -> absl::StatusOr<Map> {
                                      throw std::runtime_error("boom");
                                    });
  ASSERT_TRUE(server.ok()) << server.status();
  const absl::Status status = (*server)->LoadMaps();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("boom"));
}

TEST(Server, StopsWhileAMapLoads) {
  const test::Maps maps = {{"a", test::SmallMap(1, 2)}, {"b", test::SmallMap(2, 2)}};
  test::Gate loading;
  test::Gate may_load;
  int num_loaded = 0;
  const auto server = Server::Start(
      test::OptionsFor(maps), [&](const std::string& path, const Map*) -> absl::StatusOr<Map> {
        ++num_loaded;
        loading.Open();
        may_load.Wait();
        return maps.at(path);
      });
  ASSERT_TRUE(server.ok()) << server.status();
  std::thread loader(
      [&] { EXPECT_EQ((*server)->LoadMaps().code(), absl::StatusCode::kCancelled); });
  loading.Wait();
  (*server)->Shutdown();
  may_load.Open();
  loader.join();
  EXPECT_EQ(num_loaded, 1);
}

TEST(Server, SaysWhereItCannotListen) {
  const test::Maps maps = {{"a", test::SmallMap(1, 2)}};
  const auto first = test::StartServer(maps);
  ServerOptions options = test::OptionsFor(maps);
  options.listen = first->address();
  const auto second = Server::Start(options, test::LoaderOf(maps));
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(first->address()));
}

/// The names of all services, as the bytes of the reflection service's answer.
std::string AskForServices(const std::string& address) {
  grpc::GenericStub stub(test::ChannelTo(address));
  grpc::ClientContext context;
  test::SetPatience(context);
  grpc::CompletionQueue queue;
  const auto await = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok) && ok);
  };
  const auto call = stub.PrepareCall(
      &context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  call->StartCall(nullptr);
  await();
  const grpc::Slice list_services(std::string("\x3a\x00", 2));
  call->Write(grpc::ByteBuffer(&list_services, 1), nullptr);
  await();
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  await();
  call->WritesDone(nullptr);
  await();
  grpc::Status status;
  call->Finish(&status, nullptr);
  await();
  grpc::Slice bytes;
  EXPECT_TRUE(answer.DumpToSingleSlice(&bytes).ok());
  return {reinterpret_cast<const char*>(bytes.begin()), bytes.size()};
}

TEST(Server, TellsOfItsServicesByReflection) {
  const auto server = test::StartServer({{"town", test::SmallMap(1, 2)}});
  const std::string services = AskForServices(server->address());
  EXPECT_THAT(services, HasSubstr("scanloc.v1.Localization"));
  EXPECT_THAT(services, HasSubstr("grpc.health.v1.Health"));
}

TEST(Server, RefusesBadOptions) {
  EXPECT_EQ(Server::Start({}, test::LoaderOf({})).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace scanloc::server

// Loads a server from outside, beside a bare echo of the same message sizes (scripts/load.sh).
//
//   load_bench prepare DIR                   a map of 20,000 places, and requests for it
//   load_bench echo --response-bytes N       a server that answers N bytes to any bytes
//   load_bench run ADDRESS --requests FILE   asks it: as fast as it answers, or at a rate
//
// At a rate the arrivals are drawn in advance and do not wait for answers, and a request's time
// counts from when it was due: a server that stalls cannot hide it.
#include <grpcpp/alarm.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/proto/convert.hpp"
#include "support/bench_map.hpp"
#include "support/bench_scans.hpp"

namespace scanloc::bench {
namespace {

using Clock = std::chrono::steady_clock;

// --- requests -----------------------------------------------------------------------------------

void WriteRequests(const std::filesystem::path& path,
                   const std::vector<v1::LocalizeRequest>& requests) {
  std::ofstream file(path, std::ios::binary);
  for (const v1::LocalizeRequest& request : requests) {
    const std::string bytes = request.SerializeAsString();
    const auto size = static_cast<std::uint32_t>(bytes.size());
    file.write(reinterpret_cast<const char*>(&size), sizeof size);
    file << bytes;
  }
}

std::vector<grpc::ByteBuffer> ReadRequests(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<grpc::ByteBuffer> requests;
  std::uint32_t size = 0;
  while (file.read(reinterpret_cast<char*>(&size), sizeof size)) {
    std::string bytes(size, '\0');
    file.read(bytes.data(), size);
    const grpc::Slice slice(bytes);
    requests.emplace_back(&slice, 1);
  }
  if (requests.empty()) throw std::runtime_error("no requests in " + path);
  return requests;
}

int Prepare(const std::string& dir) {
  const BenchMap& map = LargeMap();
  std::filesystem::copy_file(map.path, std::filesystem::path(dir) / "map.scanloc",
                             std::filesystem::copy_options::overwrite_existing);
  QueryOptions fast;
  fast.method = *ParseMethod("a-pc");
  fast.num_candidates = 10;
  for (const auto& [name, options] :
       {std::pair("descriptors", fast), std::pair("descriptors_auto", QueryOptions())}) {
    std::vector<v1::LocalizeRequest> requests;
    for (const ScanDescriptor& query : map.queries) {
      v1::LocalizeRequest& request = requests.emplace_back();
      *request.mutable_descriptors() = proto::ToProto(
          SignedDescriptor{.signature = DescriptorSignature(map.params), .descriptor = query});
      *request.mutable_options() = proto::ToProto(options);
    }
    WriteRequests(std::filesystem::path(dir) / name, requests);
  }
  std::vector<v1::LocalizeRequest> requests;
  for (const PointCloud& scan : FullScans()) {
    v1::LocalizeRequest& request = requests.emplace_back();
    *request.mutable_scan() = proto::ToProto(scan);
    *request.mutable_options() = proto::ToProto(fast);
  }
  WriteRequests(std::filesystem::path(dir) / "scans", requests);
  return 0;
}

// --- the echo -----------------------------------------------------------------------------------

class Echo : public grpc::CallbackGenericService {
 public:
  explicit Echo(std::size_t response_bytes) {
    const grpc::Slice slice(std::string(response_bytes, 'x'));
    response_ = grpc::ByteBuffer(&slice, 1);
  }

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    class Call : public grpc::ServerGenericBidiReactor {
     public:
      explicit Call(const grpc::ByteBuffer& response) : response_(response) {
        StartRead(&request_);
      }
      void OnReadDone(bool ok) override {
        if (!ok) return Finish(grpc::Status(grpc::StatusCode::CANCELLED, "no request"));
        StartWriteAndFinish(&response_, {}, grpc::Status::OK);
      }
      void OnDone() override { delete this; }

     private:
      grpc::ByteBuffer request_;
      grpc::ByteBuffer response_;
    };
    return new Call(response_);
  }

 private:
  grpc::ByteBuffer response_;
};

int ServeEcho(std::size_t response_bytes) {
  sigset_t stop;
  sigemptyset(&stop);
  sigaddset(&stop, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop, nullptr);
  Echo echo(response_bytes);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterCallbackGenericService(&echo);
  builder.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
  const auto server = builder.BuildAndStart();
  std::cout << "echo ready on 127.0.0.1:" << port << std::endl;
  int signal = 0;
  sigwait(&stop, &signal);
  server->Shutdown(std::chrono::system_clock::now());
  return 0;
}

// --- the load -----------------------------------------------------------------------------------

struct LoadOptions {
  std::string address;
  std::string requests;
  double seconds = 5.0;
  double rate_per_s = 0.0;  // 0: as fast as it answers
  int num_inflight = 16;    // of these
  int num_connections = 4;
  double deadline_s = 10.0;
};

/// Calls under way, and what became of those before.
class Load {
 public:
  explicit Load(const LoadOptions& options)
      : options_(options), requests_(ReadRequests(options.requests)) {
    for (int i = 0; i < options.num_connections; ++i) {
      grpc::ChannelArguments arguments;
      arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      arguments.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
      stubs_.push_back(std::make_unique<grpc::GenericStub>(grpc::CreateCustomChannel(
          options.address, grpc::InsecureChannelCredentials(), arguments)));
    }
  }

  nlohmann::ordered_json Run() {
    const auto start = Clock::now();
    const auto end = start + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(options_.seconds));
    options_.rate_per_s > 0.0 ? RunAtRate(start, end) : RunClosed(end);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return num_under_way_ == 0; });
    return Summary(std::chrono::duration<double>(end - start).count());
  }

 private:
  struct Call {
    grpc::ClientContext context;
    grpc::ByteBuffer request;
    grpc::ByteBuffer response;
    Clock::time_point due;
  };

  void RunAtRate(Clock::time_point start, Clock::time_point end) {
    std::mt19937_64 random(1);
    std::exponential_distribution<double> gap_s(options_.rate_per_s);
    for (Clock::time_point due = start; due < end;
         due += std::chrono::duration_cast<Clock::duration>(
             std::chrono::duration<double>(gap_s(random)))) {
      std::this_thread::sleep_until(due);
      Start(due, nullptr);
    }
  }

  void RunClosed(Clock::time_point end) {
    for (int i = 0; i < options_.num_inflight; ++i) {
      Start(Clock::now(), &end);
    }
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return num_under_way_ == 0; });
  }

  /// again_until: the end of the call starts the next one before this time.
  void Start(Clock::time_point due, const Clock::time_point* again_until) {
    {
      const std::lock_guard lock(mutex_);
      ++num_under_way_;
    }
    const std::size_t number = num_started_.fetch_add(1);
    auto* call = new Call;
    call->due = due;
    call->request = requests_[number % requests_.size()];
    call->context.set_deadline(
        std::chrono::system_clock::now() +
        std::chrono::milliseconds(static_cast<int>(1000.0 * options_.deadline_s)));
    stubs_[number % stubs_.size()]->UnaryCall(
        &call->context, "/scanloc.v1.Localization/Localize", {}, &call->request, &call->response,
        [this, call, again_until](const grpc::Status& status) {
          const auto now = Clock::now();
          const double ms = std::chrono::duration<double, std::milli>(now - call->due).count();
          const std::size_t response_bytes = call->response.Valid() ? call->response.Length() : 0;
          delete call;
          if (again_until != nullptr && now < *again_until) Start(now, again_until);
          const std::lock_guard lock(mutex_);
          times_ms_[status.error_code()].push_back(ms);
          response_bytes_ = std::max(response_bytes_, response_bytes);
          if (--num_under_way_ == 0) changed_.notify_all();
        });
  }

  nlohmann::ordered_json Summary(double seconds) {
    nlohmann::ordered_json json;
    json["seconds"] = seconds;
    json["response_bytes"] = response_bytes_;
    for (auto& [code, times_ms] : times_ms_) {
      std::sort(times_ms.begin(), times_ms.end());
      const auto at = [&, &sorted = times_ms](double share) {
        return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(
                                                      share * static_cast<double>(sorted.size())))];
      };
      const std::string name =
          absl::StatusCodeToString(static_cast<absl::StatusCode>(static_cast<int>(code)));
      json[name] = {{"count", times_ms.size()},
                    {"per_s", static_cast<double>(times_ms.size()) / seconds},
                    {"p50_ms", at(0.5)},
                    {"p99_ms", at(0.99)},
                    {"max_ms", times_ms.back()}};
    }
    return json;
  }

  const LoadOptions options_;
  const std::vector<grpc::ByteBuffer> requests_;
  std::vector<std::unique_ptr<grpc::GenericStub>> stubs_;
  std::atomic<std::size_t> num_started_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t num_under_way_ = 0;
  std::size_t response_bytes_ = 0;
  std::map<grpc::StatusCode, std::vector<double>> times_ms_;
};

int Run(int argc, char** argv) {
  CLI::App app("Loads a server from outside.");
  app.require_subcommand(1);
  std::string dir;
  auto* prepare = app.add_subcommand("prepare", "write a map and requests");
  prepare->add_option("DIR", dir)->required();
  std::size_t response_bytes = 0;
  auto* echo = app.add_subcommand("echo", "answer so many bytes to any bytes until SIGTERM");
  echo->add_option("--response-bytes", response_bytes)->required();
  LoadOptions options;
  auto* run = app.add_subcommand("run", "ask a server");
  run->add_option("ADDRESS", options.address)->required();
  run->add_option("--requests", options.requests)->required();
  run->add_option("--seconds", options.seconds);
  run->add_option("--rate", options.rate_per_s, "requests a second; 0: as fast as it answers");
  run->add_option("--inflight", options.num_inflight, "calls at once, without a rate");
  run->add_option("--connections", options.num_connections);
  run->add_option("--deadline-s", options.deadline_s);
  CLI11_PARSE(app, argc, argv);
  if (prepare->parsed()) return Prepare(dir);
  if (echo->parsed()) return ServeEcho(response_bytes);
  std::cout << Load(options).Run().dump() << std::endl;
  return 0;
}

}  // namespace
}  // namespace scanloc::bench

int main(int argc, char** argv) {
  try {
    return scanloc::bench::Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "load_bench: " << error.what() << '\n';
    return 1;
  }
}

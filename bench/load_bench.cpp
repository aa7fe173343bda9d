// Loads a server from outside, beside a bare echo of the same message sizes (scripts/load.sh).
//
//   load_bench prepare DIR                   a map of 20,000 places, and requests for it
//   load_bench echo --response-bytes N       a server that answers N bytes to any bytes
//   load_bench run ADDRESS --requests FILE   asks it: as fast as it answers, or at a rate
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/proto/convert.hpp"
#include "support/bench_map.hpp"
#include "support/bench_scans.hpp"
#include "support/load.hpp"

namespace scanloc::bench {
namespace {

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
  std::filesystem::create_directories(dir);
  const BenchMap& map = LargeMap();
  std::filesystem::copy_file(map.path, std::filesystem::path(dir) / "map.scanloc",
                             std::filesystem::copy_options::overwrite_existing);
  Query fast;
  fast.method = *ParseMethod("a-pc");
  fast.num_candidates = 10;
  for (const auto& [name, options] :
       {std::pair("descriptors", fast), std::pair("descriptors_auto", Query())}) {
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

nlohmann::ordered_json Summary(const LoadResult& result) {
  nlohmann::ordered_json json;
  json["seconds"] = result.seconds;
  json["response_bytes"] = result.max_response_bytes;
  std::size_t count = 0;
  for (const auto& [code, times_ms] : result.times_ms) {
    const auto at = [&, &sorted = times_ms](double share) {
      return sorted[std::min(sorted.size() - 1,
                             static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
    };
    const std::string name =
        absl::StatusCodeToString(static_cast<absl::StatusCode>(static_cast<int>(code)));
    json[name] = {{"count", times_ms.size()},
                  {"per_s", static_cast<double>(times_ms.size()) / result.seconds},
                  {"p50_ms", at(0.5)},
                  {"p99_ms", at(0.99)},
                  {"max_ms", times_ms.back()}};
    count += times_ms.size();
  }
  json["count"] = count;
  json["refused_without_retry_after"] = result.num_without_retry_after;
  json["stream_answers"] = result.num_stream_answers;
  json["streams_broken"] = result.num_streams_broken;
  return json;
}

/// Of several files one request of each in turn; the shorter ones begin again.
std::vector<grpc::ByteBuffer> ReadMix(const std::vector<std::string>& paths) {
  std::vector<std::vector<grpc::ByteBuffer>> files;
  std::size_t longest = 0;
  for (const std::string& path : paths) {
    files.push_back(ReadRequests(path));
    longest = std::max(longest, files.back().size());
  }
  std::vector<grpc::ByteBuffer> mix;
  for (std::size_t i = 0; i < longest; ++i) {
    for (const auto& file : files) mix.push_back(file[i % file.size()]);
  }
  return mix;
}

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
  std::vector<std::string> requests;
  run->add_option("--requests", requests, "files; several are mixed, a request of each in turn")
      ->required();
  run->add_option("--seconds", options.seconds);
  run->add_option("--rate", options.rate_per_s, "requests a second; 0: as fast as it answers");
  run->add_option("--inflight", options.num_inflight, "calls at once, without a rate");
  run->add_option("--connections", options.num_connections);
  run->add_option("--deadline-s", options.deadline_s);
  run->add_option("--streams", options.num_streams, "robots that hold a stream meanwhile");
  run->add_option("--stream-rate", options.stream_rate_per_s, "scans a second of each of these");
  CLI11_PARSE(app, argc, argv);
  if (prepare->parsed()) return Prepare(dir);
  if (echo->parsed()) return ServeEcho(response_bytes);
  std::cout << Summary(RunLoad(options, ReadMix(requests))).dump() << std::endl;
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

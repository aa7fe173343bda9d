#include "support/load.hpp"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include "scanloc/core/limits.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/localization.grpc.pb.h"

namespace scanloc::bench {
namespace {

using Clock = std::chrono::steady_clock;

Clock::duration Seconds(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

std::shared_ptr<grpc::Channel> ConnectionTo(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

void ShowToken(const LoadOptions& options, grpc::ClientContext& context) {
  if (!options.token.empty()) context.AddMetadata("authorization", "Bearer " + options.token);
}

/// Calls under way, and what became of those before.
class Load {
 public:
  Load(const LoadOptions& options, const std::vector<grpc::ByteBuffer>& requests)
      : options_(options), requests_(requests) {
    if (requests.empty()) throw std::runtime_error("no requests");
    for (int i = 0; i < options.num_connections; ++i) {
      stubs_.push_back(std::make_unique<grpc::GenericStub>(ConnectionTo(options.address)));
    }
  }

  LoadResult Run() {
    const auto start = Clock::now();
    const auto end = start + Seconds(options_.seconds);
    std::vector<std::thread> robots;
    for (int i = 0; i < options_.num_streams; ++i) {
      robots.emplace_back([this, i, end] { Drive(static_cast<std::size_t>(i), end); });
    }
    options_.rate_per_s > 0.0 ? RunAtRate(start, end) : RunClosed(end);
    for (std::thread& robot : robots) robot.join();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return num_under_way_ == 0; });
    result_.seconds = options_.seconds;
    for (auto& [code, times_ms] : result_.times_ms) std::sort(times_ms.begin(), times_ms.end());
    return std::move(result_);
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
    for (Clock::time_point due = start; due < end; due += Seconds(gap_s(random))) {
      std::this_thread::sleep_until(due);
      Start(due, nullptr);
    }
  }

  void RunClosed(Clock::time_point end) {
    for (int i = 0; i < options_.num_inflight; ++i) Start(Clock::now(), &end);
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
    ShowToken(options_, call->context);
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
          Count(status, ms, response_bytes);
        });
  }

  void Count(const grpc::Status& status, double ms, std::size_t response_bytes) {
    const bool is_refused = status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED;
    const bool is_told = is_refused && proto::RetryAfter(proto::FromGrpc(status)).has_value();
    const std::lock_guard lock(mutex_);
    result_.times_ms[status.error_code()].push_back(ms);
    result_.max_response_bytes = std::max(result_.max_response_bytes, response_bytes);
    if (is_refused && !is_told) ++result_.num_without_retry_after;
    if (--num_under_way_ == 0) changed_.notify_all();
  }

  /// One robot on a stream; begins another when the server ends it, after a scan's time.
  void Drive(std::size_t number, Clock::time_point end) {
    const auto stub = v1::Localization::NewStub(ConnectionTo(options_.address));
    for (auto due = Clock::now(); due < end; due += Seconds(1.0 / options_.stream_rate_per_s)) {
      std::this_thread::sleep_until(due);
      grpc::ClientContext context;
      ShowToken(options_, context);
      const auto stream = stub->LocalizeStream(&context);
      v1::LocalizeStreamRequest request;
      v1::LocalizeStreamResponse response;
      request.mutable_config();
      bool is_open = stream->Write(request) && stream->Read(&response);
      if (!is_open) {
        const std::lock_guard lock(mutex_);
        ++result_.num_streams_broken;
      }
      for (; is_open && due < end; due += Seconds(1.0 / options_.stream_rate_per_s)) {
        std::this_thread::sleep_until(due);
        v1::LocalizeRequest query;
        grpc::ByteBuffer bytes = requests_[number++ % requests_.size()];
        grpc::ProtoBufferReader reader(&bytes);
        if (!reader.status().ok() || !query.ParseFromZeroCopyStream(&reader)) {
          throw std::runtime_error("a request is none");
        }
        v1::StreamScan& scan = *request.mutable_scan();
        scan.Clear();
        if (query.has_scan()) scan.mutable_scan()->Swap(query.mutable_scan());
        if (query.has_descriptors()) scan.mutable_descriptors()->Swap(query.mutable_descriptors());
        is_open = stream->Write(request) && stream->Read(&response) && response.has_answer();
        const std::lock_guard lock(mutex_);
        ++(is_open ? result_.num_stream_answers : result_.num_streams_broken);
      }
      stream->WritesDone();
      stream->Finish();
    }
  }

  const LoadOptions options_;
  const std::vector<grpc::ByteBuffer>& requests_;
  std::vector<std::unique_ptr<grpc::GenericStub>> stubs_;
  std::atomic<std::size_t> num_started_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t num_under_way_ = 0;
  LoadResult result_;
};

}  // namespace

std::size_t LoadResult::Count(grpc::StatusCode code) const {
  const auto found = times_ms.find(code);
  return found == times_ms.end() ? 0 : found->second.size();
}

double LoadResult::PerSecond(grpc::StatusCode code) const {
  return static_cast<double>(Count(code)) / seconds;
}

LoadResult RunLoad(const LoadOptions& options, const std::vector<grpc::ByteBuffer>& requests) {
  return Load(options, requests).Run();
}

}  // namespace scanloc::bench

#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "scanlocd_fixture.hpp"
#include "support/raw_call.hpp"
#include "support/tcp_connection.hpp"

namespace scanloc::server {

/// What a sanitizer keeps beside what is used, and how much longer all takes with it.
#ifdef SCANLOC_SANITIZED
inline constexpr long kSanitizerFactor = 8;
#else
inline constexpr long kSanitizerFactor = 1;
#endif

/// Waits until the condition holds; throws if it never does.
inline void Await(const std::string& what, const std::function<bool()>& holds) {
  const auto patience = std::chrono::steady_clock::now() + test::Process::kPatience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > patience) throw std::runtime_error("never: " + what);
    std::this_thread::yield();
  }
}

/// The real program as an operator sees it: by its log and its metrics.
class MeteredScanlocdTest : public ScanlocdTest {
 protected:
  static constexpr char kQueryToken[] = "a-token-that-may-query";
  static constexpr char kAdminToken[] = "a-token-that-may-administer";

  /// Starts the program on free ports and waits until it is ready. The words in front are a command
  /// that runs it, such as another user's.
  void StartMetered(std::vector<std::string> arguments, test::ProcessOptions options = {},
                    const std::vector<std::string>& front = {}) {
    arguments.insert(arguments.end(),
                     {"--listen", "127.0.0.1:0", "--metrics-listen", "127.0.0.1:0"});
    std::vector<std::string> command = Command(arguments);
    command.insert(command.begin(), front.begin(), front.end());
    log_ = dir_.Write("log", "");  // not the one of a server before
    options.stderr_path = log_;
    scanlocd_.emplace(command, options);
    const std::string ready = scanlocd_->ReadLine();
    const std::string log = Log();
    ASSERT_THAT(ready, testing::StartsWith("scanlocd ready on 127.0.0.1:")) << log;
    address_ = ready.substr(std::string("scanlocd ready on ").size());
    const std::size_t begin = log.find("127.0.0.1:", log.find("metrics on http://"));
    metrics_address_ = log.substr(begin, log.find('/', begin) - begin);
  }

  /// Arguments for a server that a query token and an admin token open.
  [[nodiscard]] std::vector<std::string> AdminArguments() const {
    const std::string tokens =
        std::string("robot query ") + kQueryToken + "\noperator admin " + kAdminToken + "\n";
    return {"--admin", "--token-file", dir_.Write("tokens", tokens)};
  }

  [[nodiscard]] client::Client ConnectAs(const std::string& token) const {
    auto client = client::Client::Connect({.address = address_, .token = token});
    if (!client.ok()) throw std::runtime_error(client.status().ToString());
    return *std::move(client);
  }

  /// All that the server has logged.
  [[nodiscard]] std::string Log() const { return test::ReadFile(log_); }

  /// Of a metric with its labels, as `name{label="value"}`; not a number if it is not there.
  [[nodiscard]] double Metric(const std::string& name) const {
    std::istringstream lines(test::HttpGet(metrics_address_, "/metrics"));
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(name + " ")) return std::stod(line.substr(name.size()));
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  void AwaitMetric(const std::string& name, const std::function<bool(double)>& is_good) const {
    Await(name, [&] { return is_good(Metric(name)); });
  }

  /// Memory of the server's.
  [[nodiscard]] long ResidentKb() const { return scanlocd_->StatusOf("VmRSS"); }

  /// How often the front was made anew, for this reason.
  [[nodiscard]] double NumRebuilds(const std::string& reason) const {
    return Metric("scanloc_front_rebuilds_total{reason=\"" + reason + "\"}");
  }

  /// Of a map, or of the server as a whole.
  [[nodiscard]] grpc::health::v1::HealthCheckResponse::ServingStatus HealthOf(
      const std::string& map = "") const {
    const auto health = grpc::health::v1::Health::NewStub(test::ChannelTo(address_));
    grpc::ClientContext context;
    test::SetPatience(context);
    grpc::health::v1::HealthCheckRequest request;
    if (!map.empty()) request.set_service("scanloc.map/" + map);
    grpc::health::v1::HealthCheckResponse response;
    EXPECT_TRUE(health->Check(&context, request, &response).ok());
    return response.status();
  }

  /// Stops the server, which must be the one that was started, and must end well.
  void ExpectStopsWell() {
    scanlocd_->Signal(SIGTERM);
    EXPECT_EQ(scanlocd_->Wait(), 0) << Log();
  }

  std::string log_;
  std::string metrics_address_;
};

}  // namespace scanloc::server

// What docker/ gives Prometheus and Grafana, before a real Prometheus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "absl/strings/str_replace.h"
#include "metered_scanlocd.hpp"
#include "support/map_files.hpp"
#include "support/paths.hpp"
#include "support/small_map.hpp"

namespace scanloc::server {
namespace {

constexpr char kPrometheus[] = "/usr/bin/prometheus";
constexpr char kPromtool[] = "/usr/bin/promtool";

class PrometheusTest : public MeteredScanlocdTest {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kPrometheus)) GTEST_SKIP() << "there is no " << kPrometheus;
  }

  static std::string Escaped(const std::string& text) {
    std::string escaped;
    for (const unsigned char c : text) {
      constexpr char kDigits[] = "0123456789ABCDEF";
      escaped += '%';
      escaped += kDigits[c / 16];
      escaped += kDigits[c % 16];
    }
    return escaped;
  }

  /// What Prometheus says to an expression.
  [[nodiscard]] nlohmann::json Query(const std::string& expression) const {
    const std::string said =
        test::HttpGet(prometheus_address_, "/api/v1/query?query=" + Escaped(expression));
    return nlohmann::json::parse(said.substr(said.find("\r\n\r\n") + 4), nullptr, false);
  }

  void StartPrometheus() {
    // Prometheus takes no port 0: one that was free a moment ago.
    const std::string port = [] {
      const int fd = socket(AF_INET, SOCK_STREAM, 0);
      sockaddr_in own = {};
      own.sin_family = AF_INET;
      own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      bind(fd, reinterpret_cast<sockaddr*>(&own), sizeof own);
      socklen_t size = sizeof own;
      getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size);
      close(fd);
      return std::to_string(ntohs(own.sin_port));
    }();
    prometheus_address_ = "127.0.0.1:" + port;
    const std::string config = dir_.Write(
        "prometheus.yml", "global: { scrape_interval: 250ms }\nrule_files: [\"" +
                              test::SourceDir() + "/docker/alerts.yml\"]\nscrape_configs:\n" +
                              "  - job_name: scanlocd\n    static_configs: [{ targets: [\"" +
                              metrics_address_ + "\"] }]\n");
    prometheus_.emplace(std::vector<std::string>{kPrometheus, "--config.file=" + config,
                                                 "--storage.tsdb.path=" + dir_.File("tsdb"),
                                                 "--web.listen-address=" + prometheus_address_},
                        test::ProcessOptions{.stderr_path = dir_.Write("prometheus.log", "")});
    Await("Prometheus scrapes", [this] {
      try {
        const nlohmann::json up = Query("up == 1");
        return up.is_object() && !up["data"]["result"].empty();
      } catch (const std::exception&) {  // it does not listen yet
        return false;
      }
    });
  }

  std::string prometheus_address_;
  std::optional<test::Process> prometheus_;
};

TEST_F(PrometheusTest, TakesTheAlerts) {
  test::Process promtool({kPromtool, "check", "rules", test::SourceDir() + "/docker/alerts.yml"});
  EXPECT_EQ(promtool.Wait(), 0) << promtool.rest_of_stdout() << promtool.stderr_text();
}

TEST_F(PrometheusTest, AnswersEveryPanelOfTheDashboard) {
  const std::string map = dir_.File("town.scanloc");
  test::WriteSmallMap(map, 1, 4);
  StartMetered({"--map", "town=" + map});
  StartPrometheus();
  const auto robot = client::Client::Connect({.address = address_});
  ASSERT_TRUE(robot.ok()) << robot.status();
  const auto ask = [&] {
    (void)robot->LocalizeScan(test::QueryScan(1, 2));
    (void)robot->LocalizeScan(test::QueryScan(1, 2), {.map = "nowhere"});
  };
  ask();
  Await("requests are counted", [&] {
    ask();
    return !Query("rate(scanloc_requests_total{map=\"town\"}[10s]) > 0")["data"]["result"].empty();
  });
  const auto dashboard =
      nlohmann::json::parse(test::ReadFile(test::SourceDir() + "/docker/grafana-dashboard.json"));
  int num_queries = 0;
  for (const nlohmann::json& panel : dashboard["panels"]) {
    for (const nlohmann::json& target : panel["targets"]) {
      const std::string expression = absl::StrReplaceAll(
          target["expr"].get<std::string>(), {{"$map", "town"}, {"$__rate_interval", "10s"}});
      const nlohmann::json said = Query(expression);
      EXPECT_EQ(said["status"], "success") << expression << said.dump();
      // Nothing is refused here, and so there is no rate of it.
      const bool may_be_empty = expression.find("scanloc_rejected_total") != std::string::npos;
      EXPECT_TRUE(may_be_empty || !said["data"]["result"].empty()) << expression;
      ++num_queries;
    }
  }
  EXPECT_GE(num_queries, 12);
}

}  // namespace
}  // namespace scanloc::server

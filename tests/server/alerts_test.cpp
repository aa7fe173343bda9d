// What docker/ watches and publishes, against what docs/operations.md tells an operator.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

#include "support/paths.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::server {
namespace {

/// All that the first group of the expression matches in the text.
std::set<std::string> Matches(const std::string& text, const char* expression) {
  const std::regex regex(expression);
  std::set<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), regex), end; match != end; ++match) {
    found.insert((*match)[1]);
  }
  return found;
}

TEST(Alerts, AreEachExplainedAndLookAtMetricsThatAre) {
  const std::string alerts = test::ReadFile(test::SourceDir() + "/docker/alerts.yml");
  const std::string manual = test::ReadFile(test::SourceDir() + "/docs/operations.md");
  const std::set<std::string> names = Matches(alerts, "alert: (\\w+)");
  EXPECT_GE(names.size(), 8U);
  EXPECT_EQ(names, Matches(manual, "\n\\| `(Scanloc\\w+)` \\|"));
  // One label each, by which whoever is told is chosen.
  EXPECT_EQ(
      Matches(
          alerts,
          "alert: (\\w+)\n(?:(?!alert:)[\\s\\S])*labels: \\{ severity: (?:critical|warning) \\}\n"),
      names);
  const std::set<std::string> metrics = Matches(alerts, "(scanloc_\\w+?)(?:_bucket)?[^\\w]");
  EXPECT_GE(metrics.size(), 6U);
  for (const std::string& metric : metrics) {
    EXPECT_THAT(manual, testing::HasSubstr("`" + metric)) << metric;
  }
}

TEST(Compose, PublishesToThisMachineOnlyWhatItAsksTokensFor) {
  const std::string compose = test::ReadFile(test::SourceDir() + "/docker/compose.yaml");
  EXPECT_EQ(Matches(compose, "ports: (.*)\n"),
            (std::set<std::string>{"[\"127.0.0.1:50061:50061\"]", "[\"127.0.0.1:9090:9090\"]"}));
  EXPECT_THAT(compose, testing::HasSubstr("\"--token-file\""));
}

TEST(Compose, SaysWhichVersionOfEveryImage) {
  const std::string compose = test::ReadFile(test::SourceDir() + "/docker/compose.yaml");
  const std::set<std::string> images = Matches(compose, "image: (\\S+)\n");
  EXPECT_EQ(images.size(), 3U);
  for (const std::string& image : images) {
    EXPECT_THAT(image, testing::ContainsRegex(":(local|v?[0-9]+\\.[0-9]+\\.[0-9]+)$"));
  }
}

}  // namespace
}  // namespace scanloc::server

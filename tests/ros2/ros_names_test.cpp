#include "ros_names.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace scanloc::ros2 {
namespace {

TEST(DdsTopicName, PutsRelativeNamesIntoTheNamespace) {
  for (const auto& [ns, topic, name] : std::vector<std::array<std::string, 3>>{
           {"", "points", "rt/points"},
           {"/", "points", "rt/points"},
           {"robot1", "points", "rt/robot1/points"},
           {"/fleet/robot1/", "lidar/points", "rt/fleet/robot1/lidar/points"},
           {"robot1", "/tf", "rt/tf"}}) {
    EXPECT_EQ(DdsTopicName(ns, topic).value(), name);
  }
}

TEST(DdsTopicName, RefusesWhatIsNoName) {
  for (const auto& [ns, topic] :
       std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                        {"", "/"},
                                                        {"", "points/"},
                                                        {"", "a//b"},
                                                        {"", "2d"},
                                                        {"a b", "points"},
                                                        {"", "poi\nnts"},
                                                        {"", std::string(300, 'a')},
                                                        {"//", "points"}}) {
    EXPECT_EQ(DdsTopicName(ns, topic).status().code(), absl::StatusCode::kInvalidArgument)
        << ns << " " << topic;
  }
}

}  // namespace
}  // namespace scanloc::ros2

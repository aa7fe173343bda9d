#pragma once

#include <dds/dds.h>

#include <string>
#include <vector>

namespace scanloc::ros2 {

/// A topic that is read: what its publishers must be like.
struct ReadTopic {
  std::string dds_name;
  std::string dds_type;
  bool is_reliable = false;         ///< hears no publisher that is best effort
  bool is_transient_local = false;  ///< hears none that is volatile
  std::string if_best_effort;       ///< what to say then; empty: that it is not heard
};

/// What a look at who publishes in the domain tells.
struct Publishers {
  std::vector<std::string> problems;      ///< of those on topics that are read, but not heard
  std::vector<std::string> cloud_topics;  ///< as ROS names them; sorted, some
};

/// Reads the built-in topic of publications.
[[nodiscard]] Publishers LookAtPublishers(dds_entity_t publications,
                                          const std::vector<ReadTopic>& topics);

}  // namespace scanloc::ros2

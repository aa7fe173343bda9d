#include "unheard.hpp"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "ros_messages.h"
#include "scanloc/core/printable.hpp"

namespace scanloc::ros2 {
namespace {

/// "sensor_msgs/PointCloud2" of what rosidl names "sensor_msgs::msg::dds_::PointCloud2_".
std::string RosType(std::string dds_type) {
  if (dds_type.ends_with('_')) dds_type.pop_back();
  return absl::StrReplaceAll(dds_type, {{"::msg::dds_::", "/"}});
}

/// Why this one is not heard; empty if it is.
std::string Problem(const dds_builtintopic_endpoint_t& publisher, const ReadTopic& topic) {
  const std::string name = topic.dds_name.substr(2);
  if (publisher.type_name != topic.dds_type) {
    return absl::StrCat(name, " is of type ", Printable(publisher.type_name), "; only ",
                        RosType(topic.dds_type), " is read");
  }
  dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
  (void)dds_qget_reliability(publisher.qos, &reliability, nullptr);
  if (topic.is_reliable && reliability == DDS_RELIABILITY_BEST_EFFORT) {
    if (!topic.if_best_effort.empty()) return topic.if_best_effort;
    return absl::StrCat("a publisher of ", name, " is best effort and not heard");
  }
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
  (void)dds_qget_durability(publisher.qos, &durability);
  if (topic.is_transient_local && durability == DDS_DURABILITY_VOLATILE) {
    return absl::StrCat("a publisher of ", name,
                        " is volatile, not transient local, and not heard");
  }
  return "";
}

void SortAndCut(std::vector<std::string>& texts) {
  constexpr std::size_t kMost = 8;
  std::ranges::sort(texts);
  texts.erase(std::unique(texts.begin(), texts.end()), texts.end());
  if (texts.size() > kMost) texts.resize(kMost);
}

}  // namespace

Publishers LookAtPublishers(dds_entity_t publications, const std::vector<ReadTopic>& topics) {
  const std::string_view cloud_type = sensor_msgs_msg_dds__PointCloud2__desc.m_typename;
  constexpr std::size_t kMost = 10'000;
  std::vector<void*> samples(kMost);
  std::vector<dds_sample_info_t> infos(kMost);
  constexpr std::uint32_t kThereNow =
      DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE;
  const dds_return_t num =
      dds_read_mask(publications, samples.data(), infos.data(), kMost, kMost, kThereNow);
  Publishers publishers;
  for (dds_return_t i = 0; i < num; ++i) {
    if (!infos[i].valid_data) continue;
    const auto& found = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    const std::string_view name = found.topic_name;
    if (found.type_name == cloud_type && name.starts_with("rt/")) {
      publishers.cloud_topics.push_back(Printable(name.substr(2)));
    }
    for (const ReadTopic& topic : topics) {
      if (name != topic.dds_name) continue;
      std::string problem = Problem(found, topic);
      if (!problem.empty()) publishers.problems.push_back(std::move(problem));
    }
  }
  if (num > 0) (void)dds_return_loan(publications, samples.data(), num);
  SortAndCut(publishers.problems);
  SortAndCut(publishers.cloud_topics);
  return publishers;
}

}  // namespace scanloc::ros2

#include "bag/bag_topics.hpp"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kTfPrefix = "tf:";

// What drivers publish beside clouds, or in place of them, and how clouds come of it.
absl::string_view Advice(const std::string& type) {
  if (absl::EndsWith(type, "/CustomMsg")) {
    return ", Livox's own: have its driver publish PointCloud2 (xfer_format 0)";
  }
  const bool is_scan = absl::EndsWith(type, "Scan") && !absl::StartsWith(type, "sensor_msgs/");
  if (is_scan || absl::StrContains(type, "Packet") || absl::EndsWith(type, "/UdpFrame")) {
    return ", raw packets: play them to their driver, and record its PointCloud2";
  }
  return "";
}

std::string TypeText(const BagTopic& topic) {
  return absl::StrCat(Printable(topic.type), topic.format == WireFormat::kOther
                                                 ? ", in an encoding that is not read"
                                                 : Advice(topic.type));
}

std::string Listed(const std::vector<const BagTopic*>& topics) {
  if (topics.empty()) return "none";
  return absl::StrJoin(topics, ", ", [](std::string* out, const BagTopic* topic) {
    absl::StrAppend(out, Quote(topic->name), " (", TypeText(*topic), ")");
  });
}

}  // namespace

bool IsCloud(const BagTopic& topic) {
  return topic.type == kCloudType && topic.format != WireFormat::kOther;
}
bool IsPoses(const BagTopic& topic) {
  return IsPoseType(topic.type) && topic.format != WireFormat::kOther;
}
bool IsTransforms(const BagTopic& topic) {
  return IsTransformType(topic.type) && topic.format != WireFormat::kOther;
}
bool IsStatic(const BagTopic& topic) { return absl::EndsWith(topic.name, "tf_static"); }

std::vector<const BagTopic*> TopicsOf(const Bag& bag, bool (*is_wanted)(const BagTopic& topic)) {
  std::vector<const BagTopic*> topics;
  for (const BagTopic& topic : bag.topics()) {
    if (is_wanted(topic) && topic.num_messages > 0) topics.push_back(&topic);
  }
  return topics;
}

absl::StatusOr<const BagTopic*> ChooseTopic(const Bag& bag, const std::string& name,
                                            const std::vector<const BagTopic*>& usable,
                                            std::string_view what, std::string_view option) {
  if (name.empty()) {
    if (usable.size() == 1) return usable[0];
    if (usable.empty()) {
      return Invalid(absl::StrCat("the bag has no topic of ", ToAbsl(what), "; it has ",
                                  Listed(TopicsOf(bag, [](const BagTopic&) { return true; }))));
    }
    return Invalid(absl::StrCat("the bag has several topics of ", ToAbsl(what), "; choose one by ",
                                ToAbsl(option), ": ", Listed(usable)));
  }
  const BagTopic* topic = bag.FindTopic(name);
  if (topic != nullptr && std::ranges::find(usable, topic) != usable.end()) {
    return topic;
  }
  return Invalid(absl::StrCat("topic ", Quote(name),
                              topic == nullptr
                                  ? " is not in the bag"
                                  : absl::StrCat(" is of type ", TypeText(*topic), " and holds ",
                                                 topic->num_messages, " messages"),
                              "; of ", ToAbsl(what), " there are: ", Listed(usable)));
}

absl::StatusOr<PoseTopics> ChoosePoses(const Bag& bag, const BagDriveOptions& options,
                                       bool needs_poses) {
  PoseTopics chosen;
  const std::vector<const BagTopic*> transforms = TopicsOf(bag, &IsTransforms);
  if (absl::StartsWith(options.poses_from, ToAbsl(kTfPrefix))) {
    const std::vector<std::string> frames =
        absl::StrSplit(options.poses_from.substr(kTfPrefix.size()), ':');
    chosen.parent = std::string(absl::StripPrefix(frames.front(), "/"));
    if (frames.size() > 1) chosen.child = std::string(absl::StripPrefix(frames[1], "/"));
    if (chosen.parent.empty() || frames.size() > 2 ||
        (frames.size() == 2 && chosen.child.empty())) {
      return Invalid(
          "--poses-from tf: needs the name of a frame, such as tf:map, or two, tf:map:base_link");
    }
    if (transforms.empty()) return Invalid("the bag has no transforms, which tf: needs");
    if (!options.calib_file.empty() && chosen.child.empty()) {
      return Invalid(
          "--calib is for poses of a body, of a topic or tf:FRAME:BODY; by tf:FRAME the mount is "
          "that of the transforms");
    }
    chosen.transforms = transforms;
    return chosen;
  }
  const std::vector<const BagTopic*> usable = TopicsOf(bag, &IsPoses);
  // Where nothing but the shape of a scan hangs on them, they must be plain.
  if (!needs_poses && options.poses_from.empty() && usable.size() != 1) return chosen;
  const auto topic = ChooseTopic(bag, options.poses_from, usable, "poses", "--poses-from");
  if (!topic.ok()) {
    if (transforms.empty()) return topic.status();
    return Invalid(absl::StrCat(topic.status().message(), "; tf:FRAME takes poses from TF"));
  }
  chosen.poses = *topic;
  for (const BagTopic* of_tf : transforms) {
    if (IsStatic(*of_tf)) chosen.transforms.push_back(of_tf);
  }
  return chosen;
}

}  // namespace scanloc::dataset

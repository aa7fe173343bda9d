#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/bag_drive.hpp"

/// Which topics of a bag are used.
namespace scanloc::dataset {

/// Whether messages of a topic are clouds, poses or transforms that can be read.
[[nodiscard]] bool IsCloud(const BagTopic& topic);
[[nodiscard]] bool IsPoses(const BagTopic& topic);
[[nodiscard]] bool IsTransforms(const BagTopic& topic);
/// Whether transforms hold for all times.
[[nodiscard]] bool IsStatic(const BagTopic& topic);

/// The topics of that sort that have messages.
[[nodiscard]] std::vector<const BagTopic*> TopicsOf(const Bag& bag,
                                                    bool (*is_wanted)(const BagTopic& topic));

/// The topic of this name among the usable ones, or without a name the only one of them.
/// InvalidArgument otherwise, with the topics that there are of `what`; `option` chooses one.
[[nodiscard]] absl::StatusOr<const BagTopic*> ChooseTopic(
    const Bag& bag, const std::string& name, const std::vector<const BagTopic*>& usable,
    std::string_view what, std::string_view option);

/// Where the poses of a drive come from.
struct PoseTopics {
  const BagTopic* poses = nullptr;          ///< null: by TF, or none
  std::vector<const BagTopic*> transforms;  ///< with `poses`, the static ones
  std::string parent;                       ///< of the poses by TF
  std::string child;                        ///< of them; empty: the sensor
};

/// As BagDriveOptions say. Without poses_from, and where poses are not needed, the only topic of
/// them or none. InvalidArgument, with the topics there are, if they say nothing that is there.
[[nodiscard]] absl::StatusOr<PoseTopics> ChoosePoses(const Bag& bag, const BagDriveOptions& options,
                                                     bool needs_poses);

}  // namespace scanloc::dataset

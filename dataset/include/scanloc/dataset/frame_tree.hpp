#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/dataset/ros_messages.hpp"

namespace scanloc::dataset {

/// Poses of one frame in another over time.
class PoseTrack {
 public:
  /// For all times.
  void SetStatic(const Pose& pose) { static_ = pose; }
  [[nodiscard]] const std::optional<Pose>& fixed() const { return static_; }
  void Add(std::int64_t stamp_ns, const Pose& pose) { samples_.emplace_back(stamp_ns, pose); }
  void Sort();
  /// Drops the samples before a time. Requires Sort.
  void ForgetBefore(std::int64_t stamp_ns);

  [[nodiscard]] bool is_static() const { return static_.has_value() && samples_.empty(); }
  /// Samples; none if it is static.
  [[nodiscard]] const std::vector<std::pair<std::int64_t, Pose>>& samples() const {
    return samples_;
  }

  /// Interpolated between the samples around a time; none before the first, after the last, where
  /// these lie more than kMaxPoseGap_ns apart, and where one of them is contradicted. Requires
  /// Sort.
  [[nodiscard]] std::optional<Pose> At(std::int64_t stamp_ns) const;

  /// Samples that lie elsewhere than those before and after them say, by more than 0.5 m or 10
  /// degrees, and what hard braking or stamps that are off by 30 ms make of it: two sources tell
  /// poses in turn, a clock was set back, or poses were corrected there. Requires Sort.
  [[nodiscard]] std::size_t NumContradicted() const;

 private:
  [[nodiscard]] bool IsContradicted(std::size_t i) const;

  std::optional<Pose> static_;
  std::vector<std::pair<std::int64_t, Pose>> samples_;
};

/// Where a frame lies in another: a way through the tree.
class FrameChain {
 public:
  /// Moves on by T_a_b of a track, or by its inverse. The track must outlive the chain.
  void Append(const PoseTrack* track, bool is_inverse) { steps_.emplace_back(track, is_inverse); }
  /// Moves on by a mount.
  void AppendMount(const Pose& mount) { mount_ = mount_ * mount; }

  [[nodiscard]] std::optional<Pose> At(std::int64_t stamp_ns) const;
  /// Of all its tracks.
  [[nodiscard]] std::size_t NumContradicted() const;

 private:
  std::vector<std::pair<const PoseTrack*, bool>> steps_;
  Pose mount_ = Pose::Identity();
};

/// The tree of frames that transforms make.
class FrameTree {
 public:
  /// A frame in itself says nothing and is passed over; of static poses the last one holds.
  void Add(const StampedPose& pose, bool is_static);
  /// After the last Add.
  void Sort();
  /// Frames that have a parent.
  [[nodiscard]] std::size_t size() const { return edges_.size(); }

  /// T_parent_child over time. InvalidArgument, with the frames there are, if they do not connect,
  /// if a frame on the way was given two parents, or if the frames go in a circle, which gives two
  /// ways.
  [[nodiscard]] absl::StatusOr<FrameChain> Connect(const std::string& parent,
                                                   const std::string& child) const;

  /// Frames that static poses were told of which differ by more than 0.1 m or 1 degree.
  [[nodiscard]] const std::set<std::string>& moved() const { return moved_; }

  /// The samples of all frames, for telling when there are poses.
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::int64_t>> Span() const;

 private:
  struct Edge {
    std::string parent;
    std::optional<std::string> other_parent;  ///< there should be none
    PoseTrack track;                          ///< in `parent`
  };
  /// Moves on from a frame to its parent, or by the inverse.
  [[nodiscard]] absl::Status AppendEdge(const std::string& frame, bool is_inverse,
                                        FrameChain& chain) const;
  /// The frames from one up to its root.
  [[nodiscard]] std::vector<std::string> WayUp(const std::string& frame) const;

  std::map<std::string, Edge> edges_;  // by child
  std::set<std::string> moved_;
};

}  // namespace scanloc::dataset

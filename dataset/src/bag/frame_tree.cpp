#include "scanloc/dataset/frame_tree.hpp"

#include <algorithm>
#include <iterator>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/bag_drive.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

Pose Interpolate(const Pose& a, const Pose& b, double share) {
  Pose pose = Pose::Identity();
  pose.translate(a.translation() + share * (b.translation() - a.translation()));
  pose.rotate(Eigen::Quaterniond(a.linear()).slerp(share, Eigen::Quaterniond(b.linear())));
  return pose;
}

bool IsEarlier(const std::pair<std::int64_t, Pose>& a, const std::pair<std::int64_t, Pose>& b) {
  return a.first < b.first;
}

bool IsElsewhere(const Pose& a, const Pose& b, double max_m, double max_rad) {
  const Pose moved = a.inverse() * b;
  return moved.translation().norm() > max_m || Eigen::AngleAxisd(moved.linear()).angle() > max_rad;
}

// As doubles: the difference of two stamps need not fit.
double Gap_ns(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns) - static_cast<double>(from_ns);
}

}  // namespace

void PoseTrack::Sort() { std::ranges::stable_sort(samples_, &IsEarlier); }

void PoseTrack::ForgetBefore(std::int64_t stamp_ns) {
  samples_.erase(samples_.begin(),
                 std::lower_bound(samples_.begin(), samples_.end(),
                                  std::pair(stamp_ns, Pose::Identity()), &IsEarlier));
}

std::optional<Pose> PoseTrack::At(std::int64_t stamp_ns) const {
  if (samples_.empty()) return static_;
  const auto after = std::lower_bound(samples_.begin(), samples_.end(),
                                      std::pair(stamp_ns, Pose::Identity()), &IsEarlier);
  if (after == samples_.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - samples_.begin());
  if (IsContradicted(i)) return std::nullopt;
  if (after->first == stamp_ns) return after->second;
  if (i == 0 || IsContradicted(i - 1)) return std::nullopt;
  const auto before = std::prev(after);
  const double gap_ns = Gap_ns(before->first, after->first);
  if (gap_ns > static_cast<double>(kMaxPoseGap_ns)) return std::nullopt;
  const double share = static_cast<double>(stamp_ns - before->first) / gap_ns;
  return Interpolate(before->second, after->second, share);
}

bool PoseTrack::IsContradicted(std::size_t i) const {
  constexpr double kMax_m = 0.5;
  constexpr double kMax_rad = 0.1745;
  constexpr double kBraking_m_per_s2 = 10.0;
  constexpr double kTurning_rad_per_s = 1.0;
  constexpr double kLate_s = 0.03;  // stamps of reception
  if (i == 0 || i + 1 >= samples_.size()) return false;
  const auto& [before_ns, before] = samples_[i - 1];
  const auto& [after_ns, after] = samples_[i + 1];
  const double gap_ns = Gap_ns(before_ns, after_ns);
  if (gap_ns > static_cast<double>(kMaxPoseGap_ns)) return false;
  const double share = gap_ns > 0.0 ? Gap_ns(before_ns, samples_[i].first) / gap_ns : 0.0;
  const double gap_s = 1e-9 * gap_ns;
  const double way_m = (after.translation() - before.translation()).norm();
  const double late_m = gap_s > 0.0 ? kLate_s * way_m / gap_s : 0.0;
  return IsElsewhere(Interpolate(before, after, share), samples_[i].second,
                     kMax_m + late_m + kBraking_m_per_s2 * gap_s * gap_s / 8.0,
                     kMax_rad + kTurning_rad_per_s * gap_s);
}

std::size_t PoseTrack::NumContradicted() const {
  std::size_t num = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i) num += IsContradicted(i) ? 1 : 0;
  return num;
}

std::size_t FrameChain::NumContradicted() const {
  std::size_t num = 0;
  for (const auto& [track, is_inverse] : steps_) num += track->NumContradicted();
  return num;
}

std::optional<Pose> FrameChain::At(std::int64_t stamp_ns) const {
  Pose T_parent_here = Pose::Identity();
  for (const auto& [track, is_inverse] : steps_) {
    const std::optional<Pose> step = track->At(stamp_ns);
    if (!step) return std::nullopt;
    T_parent_here = T_parent_here * (is_inverse ? step->inverse() : *step);
  }
  return T_parent_here * mount_;
}

void FrameTree::Add(const StampedPose& pose, bool is_static) {
  if (pose.child == pose.parent) return;
  Edge& edge = edges_.try_emplace(pose.child, Edge{.parent = pose.parent}).first->second;
  if (edge.parent != pose.parent) {
    edge.other_parent = pose.parent;
  } else if (is_static) {
    constexpr double kMax_m = 0.1;
    constexpr double kMax_rad = 0.0175;
    const std::optional<Pose>& before = edge.track.fixed();
    if (before && IsElsewhere(*before, pose.T_parent_child, kMax_m, kMax_rad)) {
      moved_.insert(pose.child);
    }
    edge.track.SetStatic(pose.T_parent_child);
  } else {
    edge.track.Add(pose.stamp_ns, pose.T_parent_child);
  }
}

void FrameTree::Sort() {
  for (auto& [child, edge] : edges_) edge.track.Sort();
}

std::vector<std::string> FrameTree::WayUp(const std::string& frame) const {
  std::vector<std::string> way = {frame};
  // A circle would be longer than the tree.
  while (way.size() <= edges_.size() + 1) {
    const auto edge = edges_.find(way.back());
    if (edge == edges_.end()) break;
    way.push_back(edge->second.parent);
  }
  return way;
}

absl::Status FrameTree::AppendEdge(const std::string& frame, bool is_inverse,
                                   FrameChain& chain) const {
  const Edge& edge = edges_.at(frame);
  if (edge.other_parent) {
    return absl::InvalidArgumentError(absl::StrCat("frame ", Quote(frame), " has two parents, ",
                                                   Quote(edge.parent), " and ",
                                                   Quote(*edge.other_parent)));
  }
  chain.Append(&edge.track, is_inverse);
  return absl::OkStatus();
}

absl::StatusOr<FrameChain> FrameTree::Connect(const std::string& parent,
                                              const std::string& child) const {
  const std::vector<std::string> up = WayUp(parent);
  const std::vector<std::string> down = WayUp(child);
  const auto meet = std::find_first_of(down.begin(), down.end(), up.begin(), up.end());
  if (meet == down.end()) {
    std::set<std::string> frames;
    for (const auto& [frame, edge] : edges_) frames.insert({Quote(frame), Quote(edge.parent)});
    return absl::InvalidArgumentError(
        absl::StrCat("no transforms connect frame ", Quote(child), " to ", Quote(parent),
                     "; there are ", frames.empty() ? "none at all" : absl::StrJoin(frames, ", ")));
  }
  const std::vector<std::string> above = WayUp(*meet);
  if (const auto again = std::find(above.begin() + 1, above.end(), *meet); again != above.end()) {
    const auto quoted = [](std::string* out, const std::string& frame) { *out += Quote(frame); };
    return absl::InvalidArgumentError(
        absl::StrCat("transforms go in a circle: ",
                     absl::StrJoin(above.begin(), again + 1, " lies in ", quoted)));
  }
  FrameChain chain;
  for (const std::string& frame : up) {
    if (frame == *meet) break;
    RETURN_IF_ERROR(AppendEdge(frame, true, chain));
  }
  for (auto frame = std::make_reverse_iterator(meet); frame != down.rend(); ++frame) {
    RETURN_IF_ERROR(AppendEdge(*frame, false, chain));
  }
  return chain;
}

std::optional<std::pair<std::int64_t, std::int64_t>> FrameTree::Span() const {
  std::optional<std::pair<std::int64_t, std::int64_t>> span;
  for (const auto& [frame, edge] : edges_) {
    const auto& samples = edge.track.samples();
    if (samples.empty()) continue;
    const std::pair own(samples.front().first, samples.back().first);
    span = span ? std::pair(std::max(span->first, own.first), std::min(span->second, own.second))
                : own;
  }
  return span;
}

}  // namespace scanloc::dataset

#include "scanloc/dataset/bag_drive.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "bag/bag_notes.hpp"
#include "bag/bag_topics.hpp"
#include "decimal_time.hpp"
#include "file_bytes.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/deskew.hpp"
#include "scanloc/dataset/frame_tree.hpp"
#include "scanloc/dataset/pose_reader.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::int64_t kMaxStamp_ns = 9'000'000'000'000'000'000;  // room to add a sweep

// A cloud of the bag, not read but for its header.
struct CloudHead {
  std::size_t id;
  std::int64_t stamp_ns;
  bool names_frame;
};

// The clouds of a bag, and where their sensor was.
class BagScans : public ScanStore {
 public:
  absl::StatusOr<Scan> Read(std::size_t index, bool with_intensities) const override {
    std::optional<CloudMessage> cloud;
    absl::Status status =
        bag_->Read(clouds_[index].id, [&](const BagMessage& message) -> absl::Status {
          absl::StatusOr<CloudMessage> decoded =
              DecodeCloud(message.topic->format, message.bytes, deskew_, with_intensities);
          if (!decoded.ok()) {
            return Annotate(decoded.status(), absl::StrCat(paths_, ": cloud ", index));
          }
          cloud = *std::move(decoded);
          return absl::OkStatus();
        });
    if (!status.ok()) return status;
    if (deskew_ && cloud->offsets_s.size() == cloud->scan.points.size()) {
      // Where the poses end within a sweep, its points stay as they are.
      (void)Deskew([&](std::int64_t stamp_ns) { return chain_->At(stamp_ns); },
                   clouds_[index].stamp_ns, cloud->offsets_s, cloud->scan.points);
    }
    return std::move(cloud->scan);
  }

  // Opens the bag and reads its poses and the headers of its clouds.
  absl::Status Open(const BagDriveOptions& options, bool needs_poses) {
    ASSIGN_OR_RETURN(bag_, Bag::Open(options.paths));
    notes_ = bag_->notes();
    paths_ = absl::StrJoin(options.paths, ", ");
    const auto topic =
        ChooseTopic(*bag_, options.topic, TopicsOf(*bag_, &IsCloud), "point clouds", "--topic");
    if (!topic.ok()) return Annotate(topic.status(), paths_);
    cloud_topic_ = *topic;
    absl::StatusOr<PoseTopics> poses = ChoosePoses(*bag_, options, needs_poses);
    if (!poses.ok()) return Annotate(poses.status(), paths_);
    pose_topic_ = poses->poses;
    transform_topics_ = std::move(poses->transforms);
    parent_ = std::move(poses->parent);
    child_ = std::move(poses->child);
    RETURN_IF_ERROR(ReadHeads());
    if (absl::Status status = Connect(options); !status.ok()) return Annotate(status, paths_);
    if (const absl::Status clocks = CheckClocks(cloud_delay_, pose_delay_, notes_); !clocks.ok()) {
      if (needs_poses) return Annotate(clocks, paths_);
      notes_.emplace_back(clocks.message());
      chain_.reset();
    }
    if (std::string text = ContradictionText(chain_); !text.empty()) notes_.push_back(text);
    deskew_ = options.deskew && has_poses();
    return absl::OkStatus();
  }

  [[nodiscard]] bool has_poses() const { return chain_.has_value(); }
  [[nodiscard]] const std::vector<CloudHead>& clouds() const { return clouds_; }
  [[nodiscard]] std::vector<std::int64_t> Stamps() const {
    std::vector<std::int64_t> stamps_ns;
    for (const CloudHead& cloud : clouds_) stamps_ns.push_back(cloud.stamp_ns);
    return stamps_ns;
  }
  [[nodiscard]] std::optional<Pose> PoseOf(std::size_t index) const {
    return chain_->At(clouds_[index].stamp_ns);
  }
  // When there are poses.
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::int64_t>> PoseSpan() const {
    const auto& samples = topic_track_.samples();
    if (pose_topic_ == nullptr) return tree_.Span();
    if (samples.empty()) return std::nullopt;
    return std::pair(samples.front().first, samples.back().first);
  }
  [[nodiscard]] std::vector<std::string>& notes() { return notes_; }
  [[nodiscard]] ScanFile FileOf(std::size_t index, std::shared_ptr<const BagScans> self) const {
    const std::int64_t stamp_ns = clouds_[index].stamp_ns;
    return {.path = paths_,
            .name = absl::StrFormat("%d.%09d", stamp_ns / kNanosecondsPerS,
                                    std::abs(stamp_ns % kNanosecondsPerS)),
            .store = std::move(self),
            .index = index};
  }

 private:
  absl::Status ReadHeads() {
    std::vector<const BagTopic*> topics = transform_topics_;
    topics.push_back(cloud_topic_);
    if (pose_topic_ != nullptr) topics.push_back(pose_topic_);
    BagDamage damage;
    const auto add = [&](const BagMessage& message) {
      absl::Status added = message.topic == cloud_topic_ ? AddCloud(message) : AddPoses(message);
      return Annotate(added, absl::StrCat(paths_, ": topic ", Quote(message.topic->name),
                                          ", message recorded at ", message.log_time_ns, " ns"));
    };
    RETURN_IF_ERROR(bag_->ForEach(topics, add, &damage));
    if (clouds_.empty()) {
      return absl::DataLossError(absl::StrCat(paths_, ": no cloud is left: ", damage.Text()));
    }
    if (!damage.empty()) notes_.push_back(damage.Text());
    // Where others name the frame of the sensor, what names none may be of any.
    if (!sensor_frame_.empty()) {
      const std::size_t num_nameless =
          std::erase_if(clouds_, [](const CloudHead& cloud) { return !cloud.names_frame; });
      if (num_nameless > 0) {
        notes_.push_back(absl::StrCat(num_nameless, " clouds of ", Quote(cloud_topic_->name),
                                      " name no frame, where others are of ", Quote(sensor_frame_),
                                      ": they are left out"));
      }
    }
    std::ranges::stable_sort(clouds_, {}, &CloudHead::stamp_ns);
    tree_.Sort();
    topic_track_.Sort();
    for (const std::string& frame : tree_.moved()) {
      notes_.push_back(
          absl::StrCat("tf_static says of ", Quote(frame),
                       " several times where it is, and not the same: the last is taken"));
    }
    if (num_unstamped_ > 0) {
      notes_.push_back(absl::StrCat(num_unstamped_, " clouds of ", Quote(cloud_topic_->name),
                                    " have no stamp: the time of recording is taken"));
    }
    if (num_bad_poses_ > 0) {
      notes_.push_back(absl::StrCat(num_bad_poses_,
                                    " poses or transforms that are none (not finite, or with a "
                                    "quaternion not of length 1) are left out"));
    }
    return absl::OkStatus();
  }
  absl::Status AddCloud(const BagMessage& message) {
    const absl::StatusOr<MessageHead> head = DecodeHead(message.topic->format, message.bytes);
    if (!head.ok()) return absl::DataLossError(head.status().message());
    if (sensor_frame_.empty()) sensor_frame_ = head->frame;
    if (!head->frame.empty() && head->frame != sensor_frame_) {
      return Invalid(absl::StrCat("clouds of frame ", Quote(head->frame), " and of ",
                                  Quote(sensor_frame_), " are on one topic; one sensor is needed"));
    }
    num_unstamped_ += head->stamp_ns == 0 ? 1 : 0;
    cloud_delay_.Add(message.log_time_ns, head->stamp_ns);
    const std::int64_t stamp_ns = head->stamp_ns == 0 ? message.log_time_ns : head->stamp_ns;
    if (stamp_ns < 0 || stamp_ns > kMaxStamp_ns) {
      return absl::DataLossError(absl::StrCat("its stamp, ", stamp_ns, " ns, is none"));
    }
    clouds_.push_back({message.id, stamp_ns, !head->frame.empty()});
    return absl::OkStatus();
  }
  absl::Status AddPoses(const BagMessage& message) {
    const BagTopic& topic = *message.topic;
    const auto poses = DecodePoses(topic.type, topic.format, message.bytes, num_bad_poses_);
    if (!poses.ok()) return absl::DataLossError(poses.status().message());
    for (StampedPose pose : *poses) {
      if (!IsStatic(topic)) pose_delay_.Add(message.log_time_ns, pose.stamp_ns);
      if (pose.stamp_ns == 0) pose.stamp_ns = message.log_time_ns;
      if (&topic != pose_topic_) {
        tree_.Add(pose, IsStatic(topic));
        continue;
      }
      if (topic_track_.samples().empty()) {
        parent_ = pose.parent;
        child_ = pose.child;
      }
      if (pose.parent != parent_ || pose.child != child_) {
        return Invalid(absl::StrCat("its poses are of ", Quote(pose.child), " in ",
                                    Quote(pose.parent), " and of ", Quote(child_), " in ",
                                    Quote(parent_), "; one body in one frame is needed"));
      }
      topic_track_.Add(pose.stamp_ns, pose.T_parent_child);
    }
    return absl::OkStatus();
  }
  // The way from the frame of the poses to the sensor's.
  absl::Status Connect(const BagDriveOptions& options) {
    if (pose_topic_ == nullptr && transform_topics_.empty()) return absl::OkStatus();
    // A topic that names no body, or all alike, says nothing.
    const bool tells_body = pose_topic_ == nullptr || !child_.empty();
    if (tells_body && !parent_.empty() && sensor_frame_ == parent_ && child_ != parent_) {
      return Invalid(absl::StrCat(
          "the clouds of ", Quote(cloud_topic_->name), " are in ", Quote(sensor_frame_),
          ", as the poses are, and do not move with the robot, as those that SLAM has registered; "
          "name the topic of clouds that are in the frame of the sensor or of the robot"));
    }
    FrameChain chain;
    if (pose_topic_ == nullptr) {
      absl::StatusOr<FrameChain> by_tf =
          tree_.Connect(parent_, child_.empty() ? sensor_frame_ : child_);
      if (!by_tf.ok() && child_.empty()) {
        return Invalid(
            absl::StrCat(by_tf.status().message(),
                         "; the mount of a body that is there can be given: --poses-from "
                         "tf:FRAME:BODY --T-base-sensor X,Y,Z,ROLL,PITCH,YAW"));
      }
      if (!by_tf.ok()) return by_tf.status();
      chain = *std::move(by_tf);
    } else {
      chain.Append(&topic_track_, false);
    }
    const std::string of = pose_topic_ == nullptr ? "TF" : Quote(pose_topic_->name);
    std::string mount = "taken for those of the sensor";
    if (pose_topic_ == nullptr && (child_.empty() || child_ == sensor_frame_)) {
      mount = absl::StrCat("those of ", Quote(sensor_frame_));
    } else if (options.T_body_sensor && child_ != sensor_frame_) {
      chain.AppendMount(*options.T_body_sensor);
      mount = "taken for those of the base";
    } else if (!options.calib_file.empty()) {
      ASSIGN_OR_RETURN(const Pose T_body_sensor, ReadCalib(options.calib_file));
      chain.AppendMount(T_body_sensor);
      mount = absl::StrCat("with the mount in ", options.calib_file);
    } else if (!child_.empty() && child_ != sensor_frame_) {
      const absl::StatusOr<FrameChain> of_sensor = tree_.Connect(child_, sensor_frame_);
      const std::optional<Pose> T_body_sensor =
          of_sensor.ok() ? of_sensor->At(0) : std::optional<Pose>();
      if (!T_body_sensor) {
        return Invalid(absl::StrCat(
            "the poses of ", of, " are of ", Quote(child_), ", the clouds of ",
            Quote(cloud_topic_->name), " in ", Quote(sensor_frame_), ": ",
            of_sensor.ok() ? "no static transforms connect them" : of_sensor.status().message(),
            "; give the mount by --T-base-sensor X,Y,Z,ROLL,PITCH,YAW or --calib FILE, or take the "
            "poses from TF by --poses-from tf:FRAME"));
      }
      chain.AppendMount(*T_body_sensor);
      mount = absl::StrCat("of ", Quote(child_), ", with the mount of ", Quote(sensor_frame_),
                           " in tf_static");
    }
    chain_ = std::move(chain);
    notes_.push_back(absl::StrCat("poses of ", of, " in ", Quote(parent_), " are ", mount));
    return absl::OkStatus();
  }

  std::shared_ptr<const Bag> bag_;
  std::string paths_;
  const BagTopic* cloud_topic_ = nullptr;
  const BagTopic* pose_topic_ = nullptr;  // null: by TF, or none
  std::vector<const BagTopic*> transform_topics_;
  std::string parent_;  // of the poses
  std::string child_;   // of the poses; empty where their messages name none, or by TF the sensor
  std::string sensor_frame_;
  std::vector<CloudHead> clouds_;
  std::size_t num_unstamped_ = 0;
  std::size_t num_bad_poses_ = 0;
  RecordingDelay cloud_delay_;
  RecordingDelay pose_delay_;
  FrameTree tree_;
  PoseTrack topic_track_;
  std::optional<FrameChain> chain_;
  bool deskew_ = false;
  std::vector<std::string> notes_;
};

}  // namespace

absl::StatusOr<Drive> OpenBagDrive(const BagDriveOptions& options) {
  const auto scans = std::make_shared<BagScans>();
  if (absl::Status status = scans->Open(options, true); !status.ok()) {
    return WithNotes(status, scans->notes());
  }
  Drive drive;
  std::vector<std::size_t> without;
  for (std::size_t i = 0; i < scans->clouds().size(); ++i) {
    const std::optional<Pose> pose = scans->PoseOf(i);
    if (!pose) {
      without.push_back(i);
      continue;
    }
    const ScanFile file = scans->FileOf(i, scans);
    drive.frames.push_back({.path = file.path,
                            .name = file.name,
                            .T_map_sensor = *pose,
                            .stamp_ns = scans->clouds()[i].stamp_ns,
                            .store = file.store,
                            .index = i});
  }
  if (drive.frames.empty()) {
    const auto span = scans->PoseSpan();
    const absl::Status error = Invalid(
        absl::StrCat(absl::StrJoin(options.paths, ", "), ": none of the ", scans->clouds().size(),
                     " clouds has a pose: their stamps are ",
                     SpanText(scans->clouds().front().stamp_ns, scans->clouds().back().stamp_ns),
                     ", those of the poses ", span ? SpanText(span->first, span->second) : "none"));
    return WithNotes(error, scans->notes());
  }
  drive.notes = scans->notes();
  if (std::string leap = LeapText(drive.frames); !leap.empty()) drive.notes.push_back(leap);
  drive.num_without_pose = without.size();
  if (!without.empty()) {
    drive.notes.push_back(absl::StrCat(without.size(), " of the ", scans->clouds().size(),
                                       " clouds are left out: no poses lie around them within ",
                                       kSPerNs * static_cast<double>(kMaxPoseGap_ns),
                                       " s of each other; ", GapText(scans->Stamps(), without)));
  }
  return drive;
}

absl::StatusOr<std::vector<ScanFile>> ListBagScans(const BagDriveOptions& options,
                                                   std::vector<std::string>& notes) {
  const auto scans = std::make_shared<BagScans>();
  if (absl::Status status = scans->Open(options, false); !status.ok()) {
    return WithNotes(status, scans->notes());
  }
  std::vector<ScanFile> files;
  for (std::size_t i = 0; i < scans->clouds().size(); ++i) files.push_back(scans->FileOf(i, scans));
  notes.insert(notes.end(), scans->notes().begin(), scans->notes().end());
  return files;
}

}  // namespace scanloc::dataset

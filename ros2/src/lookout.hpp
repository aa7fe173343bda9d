#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "messages.hpp"
#include "odometry.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/dataset/frame_tree.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "scanloc/proto/messages.hpp"

namespace scanloc::ros2 {

/// When scans are asked about.
enum class Mode {
  kOnce,            ///< until there is an answer, whatever it says
  kUntilLocalized,  ///< until the robot is localized and somebody was told where
  kAlways,
};

struct LookoutOptions {
  Mode mode = Mode::kUntilLocalized;
  bool asks_at_start = true;  ///< else the first trigger begins
  bool stays = false;         ///< goes on after its last answer: for triggers, or transforms
  bool publishes_tf = false;
  std::string map_frame = "map";
  std::string odom_frame;                ///< empty: as the odometry says
  std::string base_frame = "base_link";  ///< of the robot, whose pose is told
  SensorMount mount;                     ///< how the sensor sits on it, and what is not seen
  bool knows_base = false;               ///< else T_base_sensor is as static transforms say
  bool deskews = true;         ///< takes motion out of sweeps whose points have times, by odometry
  double interval_s = 1.0;     ///< from one question to the next while localized, in [0, 3600]
  int num_misses_to_lost = 3;  ///< answers in a row that do not find the robot, in [1, 1000]
  double odometry_wait_s = 0.1;  ///< longest that a scan waits for odometry of its time, in [0, 10]
};

/// A scan to ask about.
struct Question {
  PointCloud scan;
  SensorMount mount = {};           ///< of the sensor; of another one the scans begin anew
  bool begins_anew = false;         ///< the scans before it are of no use
  std::optional<Pose> T_last_scan;  ///< as in client::RobotStream::Locate
};

/// What is to be published.
struct Told {
  std::optional<PoseMessage> initial_pose;  ///< for a stack that starts from it
  std::optional<PoseMessage> pose;          ///< of every scan that is localized
  std::optional<PosesMessage> candidates;
  std::optional<TransformMessage> map_odom;
};

/// Decides which scans are asked about, and what is told of the answers. Knows neither DDS nor a
/// client nor a clock: times are handed in [ns], of a clock that is monotonic. Not thread-safe.
///
/// One question is under way at a time. Of the scans that come meanwhile the newest waits, and the
/// others are passed over and counted.
class Lookout {
 public:
  /// How long an initial pose that nobody listens to is kept for the first who does.
  static constexpr std::int64_t kUnheard_ns = 2'000'000'000;
  /// From one question to the next while the robot is not localized.
  static constexpr std::int64_t kSearchInterval_ns = 200'000'000;

  /// A cloud that has waited for longer is asked about no more: the robot may have gone on.
  static constexpr std::int64_t kOutdated_ns = kUnheard_ns;
  /// Without a cloud for so long it is told that none comes.
  static constexpr std::int64_t kSilence_ns = 10'000'000'000;

  /// How long the first scan waits for static transforms to tell where the sensor sits.
  static constexpr std::int64_t kMountWait_ns = 1'000'000'000;
  static constexpr std::size_t kMaxStaticFrames = 1000;

  explicit Lookout(const LookoutOptions& options);

  void TakeCloud(ReceivedBytes cloud, std::int64_t now_ns);
  /// Of a body that static transforms do not connect with the base it is left out, and told of. One
  /// that names no body is the base's.
  [[nodiscard]] Told TakeOdometry(const dataset::StampedPose& pose);
  /// One that does not change. Those after kMaxStaticFrames frames are passed over.
  void TakeStaticTransform(const dataset::StampedPose& pose);
  /// Begins anew, as at the start.
  void TakeTrigger();
  /// How many subscribe to the initial pose now: it is told when there are some.
  [[nodiscard]] Told TakeListeners(std::size_t num_listeners, std::int64_t now_ns);

  /// The next scan to ask about; none while a question is under way, none is due, or no scan came.
  [[nodiscard]] std::optional<Question> NextQuestion(std::int64_t now_ns);
  /// What became of the question under way.
  [[nodiscard]] Told TakeReply(const absl::StatusOr<TrackedReply>& reply, std::int64_t now_ns);

  /// When something may be due next without anything coming in.
  [[nodiscard]] std::int64_t NextChange_ns() const;

  /// All is done that the mode asks for, or it failed.
  [[nodiscard]] bool IsDone(std::int64_t now_ns) const;
  /// In the mode kOnce: an error that another try would meet, too.
  [[nodiscard]] const absl::Status& failure() const { return failure_; }

  /// How things stand, for people and monitors; the stamp is left open.
  [[nodiscard]] DiagnosticMessage Diagnose(std::int64_t now_ns) const;

 private:
  enum class State { kIdle, kSearching, kLocalized, kLost };
  struct Counts {
    std::uint64_t received = 0;
    std::uint64_t asked = 0;
    std::uint64_t passed_over = 0;
    std::uint64_t refused = 0;
    std::uint64_t without_odometry = 0;
    std::uint64_t deskewed = 0;
    std::uint64_t errors = 0;
  };

  void BeginAnew();
  /// Whether a transform may lead from the map's frame to that of the odometry.
  [[nodiscard]] bool HasOdomFrame() const {
    return !odom_frame_.empty() && odom_frame_ != options_.map_frame;
  }
  [[nodiscard]] bool WantsScan() const;
  [[nodiscard]] bool AwaitsOdometry(std::int64_t now_ns) const;
  /// T_base_sensor of clouds of a frame; none if it is not known.
  [[nodiscard]] std::optional<Pose> MountOf(const std::string& frame) const;
  [[nodiscard]] bool AwaitsMount(std::int64_t now_ns) const;
  /// Whether clouds of a frame do not move with the robot, as those that SLAM has registered.
  [[nodiscard]] bool StandsStill(const std::string& frame) const {
    return !frame.empty() && (frame == odom_parent_ || frame == options_.map_frame);
  }
  /// Takes the motion of the sensor out of the cloud, if it is known.
  void TakeMotionOut(const Pose& T_base_sensor, dataset::CloudMessage& cloud);
  /// Looks into the scan that waits.
  void Decode(std::int64_t now_ns);
  void TakeError(const absl::Status& error, std::int64_t now_ns);
  [[nodiscard]] PoseMessage TakeLocalized(const TrackedReply& reply,
                                          const dataset::MessageHead& head, std::int64_t now_ns);
  void TakeMiss();
  void Lose();
  /// One line for people, and how bad it is.
  void DiagnoseState(std::int64_t now_ns, DiagnosticMessage& diagnosis) const;

  const LookoutOptions options_;
  State state_ = State::kIdle;
  bool is_answered_ = false;   // since it began
  bool is_announced_ = false;  // the initial pose, since the robot is localized
  Counts counts_;
  Odometry odometry_;
  dataset::FrameTree static_frames_;
  std::string odom_frame_;
  std::string odom_parent_;  // the frame that the last odometry was told in
  std::string
      unconnected_;  // the body of the last odometry, where nothing connects it with the base

  std::optional<ReceivedBytes> waiting_;          // the newest, not looked into
  std::int64_t cloud_at_ns_ = 0;                  // when the newest came
  std::optional<dataset::CloudMessage> decoded_;  // is asked about next
  std::int64_t decoded_at_ns_ = 0;
  std::int64_t sweep_end_ns_ = 0;              // of what was decoded, by its stamps
  std::int64_t first_decoded_at_ns_ = 0;       // 0: none yet
  bool has_mount_ = true;                      // else it is not known
  std::string cloud_frame_;                    // of the last question
  std::optional<dataset::MessageHead> asked_;  // the question under way
  std::int64_t asked_at_ns_ = 0;
  std::optional<Pose> T_odom_asked_;  // of the base, where it is known
  std::optional<Pose> T_odom_last_;   // of the scan answered last
  std::int64_t last_stamp_ns_ = 0;
  bool begins_anew_ = true;
  bool is_outdated_ = false;  // the question under way: a trigger came
  std::int64_t not_before_ns_ = 0;

  int num_errors_in_row_ = 0;
  int num_misses_in_row_ = 0;
  std::optional<LocalizeReply> last_reply_;
  std::string cloud_problem_;  // of the last cloud looked into
  std::string problem_;        // of the last question
  absl::Status failure_;

  std::optional<PoseMessage> unheard_;  // the initial pose, until somebody listens
  std::int64_t unheard_until_ns_ = 0;
  std::optional<Pose> T_map_odom_;
};

}  // namespace scanloc::ros2

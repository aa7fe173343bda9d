#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "scanloc/core/answer.hpp"
#include "scanloc/core/auto_params.hpp"
#include "track/reckoned_pose.hpp"

namespace scanloc {

/// A spot at which a scan was found, with the log-odds that are said of it.
struct Sighting {
  Pose T_map_scan = Pose::Identity();
  std::optional<PoseCovariance> covariance;
  double score = 0.0;
  double unrivalled = 0.0;  ///< probability by this scan alone, were there no other spot
  double behind = 0.0;      ///< the best, as far as scans in a row may add it up
  double rivalry = 0.0;     ///< what this scan alone says against it beyond that
};

/// What a scan says of where the robot is.
struct Look {
  std::vector<Sighting> spots;  ///< distinct, best first
  Eigen::Vector3d up;           ///< in the map's frame
  double genuine = 0.0;         ///< log-odds that the best is where the scan was taken, or its like
  bool stands_alone = false;    ///< the scan by itself says where it was taken
  double ground_m = 0.0;        ///< how far the sensor stands above the ground that it sees
  std::optional<Pose> T_last_scan;  ///< by the odometry
  double max_step_m = 0.0;          ///< without: as far as the robot may have gone
};

/// Where a robot may be, in the light of all its scans.
struct Track {
  ReckonedPose pose;
  std::optional<PoseCovariance> covariance = {};  ///< none where the last scan did not find it
  double score = 0.0;                             ///< of its last scan that was found again
  double unrivalled = 0.0;                        ///< likewise
  double log_odds = 0.0;                          ///< of all its scans
  double told = 0.0;     ///< of these: what scans that stood alone have said against it
  double earned = 0.0;   ///< what scans that stood alone have said for it, against whatever else
  double doubt = 0.0;    ///< of the scans since it was last found where it should be
  double rivalry = 0.0;  ///< what only the last scan says against it
  int num_scans = 0;
  std::uint64_t id = 0;

  /// Log-odds by all scans, and with what only the last one says.
  [[nodiscard]] double standing() const { return log_odds - doubt; }
  [[nodiscard]] double total() const { return standing() - rivalry; }
};

/// The tracks of a robot (docs/algorithm.md, "A moving robot"). Not thread-safe.
class Tracks {
 public:
  static constexpr std::size_t kMaxTracks = 16;

  explicit Tracks(const TrackParams& params) : params_(params) {}

  /// By what all their scans say, most likely first.
  [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }

  /// The robot has moved, if it knows, and its scan says nothing.
  void PassBlindly(const std::optional<Pose>& T_last_scan);
  /// The robot has moved, if it knows, and this is what its scan says.
  void Weigh(const Look& look);

 private:
  struct Gate;
  struct Weighing;

  void Move(const std::optional<Pose>& T_last_scan);
  /// What single scans have told, long ago, no others having said it since.
  void Forget(double way_m);
  /// The robot may be anywhere that looks like where it was.
  void LoseLead();
  [[nodiscard]] Gate GateOf(const Look& look) const;
  [[nodiscard]] bool IsSure() const;
  /// Whether the robot may be on its way to another floor, and its odometry knows only a plane: it
  /// stops, as in a lift, climbs, or stands on what is no floor.
  [[nodiscard]] bool MayChangeFloors(const Look& look);
  /// What a track becomes by a scan that found it at a spot, or at none; whether it goes on there.
  bool Take(const Weighing& weighing, const Sighting* spot, Track& track) const;
  /// Most likely first, none surer than the greatest, the least likely given up.
  void Tidy(std::vector<Track> tracks);

  TrackParams params_;
  std::vector<Track> tracks_;
  bool is_sure_ = false;         // one is well ahead of all others
  bool reckons_height_ = false;  // the odometry has told more than of a plane
  double lead_height_m_ = 0.0;   // of the likeliest track when the lead began
  double usual_step_m_ = 0.0;    // mean of the last steps
  double usual_ground_m_ = 0.0;  // of the last scans' heights above ground
  double told_ago_m_ = 0.0;      // way since a scan that stood alone was counted
  std::uint64_t next_id_ = 1;
};

}  // namespace scanloc

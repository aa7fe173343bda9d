#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/localizer.hpp"

namespace scanloc {

struct TrackerOptions {
  Query query;  ///< of each scan; the method must be `auto`, which none stands for, too
  /// Without odometry: as far as the robot may have gone from one scan to the next, in (0, 1000].
  double max_step_m = 20.0;
};

/// What is said of a scan in the light of those before it.
struct TrackedAnswer {
  Answer answer;
  int num_scans = 0;  ///< that the best candidate rests on, this one included; 0 without one
  /// The robot is localized, but not where it should have got to from where it last was: it was
  /// carried off, or had been taken for being elsewhere.
  bool is_relocated = false;
};

class Tracks;
struct Look;

/// Evidence over several scans of one drive (docs/algorithm.md, "A moving robot").
///
/// Keeps a few hypotheses where the robot is, each with the log-odds that its scans speak for, and
/// moves them along with the robot. Scans that look like two places become certain as the robot
/// drives on, and what told it apart from its like lasts as long as its odometry does; a robot that
/// was carried off while it stood is found again, after one scan of doubt.
/// One robot each; not thread-safe. The same scans always give the same answers.
class Tracker {
 public:
  static constexpr std::size_t kMaxTracks = 16;

  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;
  ~Tracker();

  /// FailedPrecondition: the map does not serve `auto`. InvalidArgument: options out of range.
  [[nodiscard]] static absl::StatusOr<Tracker> Create(std::shared_ptr<const Localizer> localizer,
                                                      const TrackerOptions& options = {});

  /// Takes the next scan, and where the robot got to since the last by its own reckoning, if it
  /// knows: T_last_scan is the pose of this scan in the sensor frame of the one before.
  /// The errors of Localizer::Localize; InvalidArgument, too, for a pose that is none. After an
  /// error the state is as it was.
  [[nodiscard]] absl::StatusOr<TrackedAnswer> Update(
      const ScanDescriptor& scan, const std::optional<Pose>& T_last_scan = std::nullopt,
      const SearchControl& control = {});

  /// At most kMaxTracks.
  [[nodiscard]] std::size_t num_tracks() const;

  /// Forgets all scans.
  void Reset();

 private:
  Tracker(std::shared_ptr<const Localizer> localizer, const TrackerOptions& options);

  /// What the scan says, with the tracks where they should have got to. Cancelled as Localize is.
  [[nodiscard]] absl::StatusOr<Look> LookAt(const ScanDescriptor& scan,
                                            const std::optional<Pose>& T_last_scan,
                                            const SearchControl& control, StageTimes& times) const;
  [[nodiscard]] TrackedAnswer Tell(const StageTimes& times, const SearchControl& control);

  std::shared_ptr<const Localizer> localizer_;
  TrackerOptions options_;
  std::unique_ptr<Tracks> tracks_;
  std::uint64_t last_localized_ = 0;  // id of a track; 0: none yet
};

}  // namespace scanloc

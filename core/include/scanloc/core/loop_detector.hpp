#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/answer.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/query.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/pose_covariance.hpp"
#include "scanloc/core/search_control.hpp"

namespace scanloc {

struct LoopDetectorOptions {
  Params params;
  scanloc::Query query = {};  ///< of each scan: method, thresholds, candidates
  /// The window (paper, Sec. III): a scan is not compared with places less than so long before it,
  /// in [0, 1e6] ...
  double window_s = 30.0;
  /// ... nor with the last so many, from 0.
  int window_places = 0;
};

/// OK, or InvalidArgument that names the first bad field.
[[nodiscard]] absl::Status Validate(const LoopDetectorOptions& options);

/// A scan was taken where an earlier one was: a constraint of a pose graph.
struct Loop {
  std::int32_t place = 0;                ///< the earlier one, as Add numbered it
  Pose T_place_scan = Pose::Identity();  ///< as the scans show it, whatever the poses given to Add
  /// Of T_place_scan: the inverse of its covariance, in the order and about the axes of
  /// PoseCovariance, those of the place. None where the method tells no covariance: with `auto` it
  /// is told.
  std::optional<Eigen::Matrix<double, 6, 6>> information;
};

/// What is said of a scan.
struct LoopAnswer {
  Answer answer;             ///< as a Localizer says it of the places outside the window
  std::optional<Loop> loop;  ///< where the answer is `localized`
};

/// Loop closure inside one's own SLAM (docs/loop_closure.md): a map that grows as it is driven.
///
/// Answers are those of a Localizer over the places that lie outside the window; of `auto` with
/// more than 32,768 of them nearly so: here all of them are compared. Not thread-safe.
class LoopDetector {
 public:
  /// InvalidArgument or FailedPrecondition: the options.
  [[nodiscard]] static absl::StatusOr<LoopDetector> Create(const LoopDetectorOptions& options = {});

  /// Takes the next place and numbers it, from 0. T_map_scan: where the SLAM takes the scan to be;
  /// near places must stand to each other about as they do. Amortised O(log² n).
  ///
  /// InvalidArgument: a stamp before that of the place before, a pose that is none, a descriptor of
  /// other parameters. ResourceExhausted: limits::kMaxPlaces. The state is then as it was.
  [[nodiscard]] absl::StatusOr<std::int32_t> Add(PointView scan, std::int64_t stamp_ns,
                                                 const Pose& T_map_scan);
  [[nodiscard]] absl::StatusOr<std::int32_t> Add(PlaceDescriptor scan, std::int64_t stamp_ns,
                                                 const Pose& T_map_scan);

  /// Whether the scan was taken at an earlier place. It need not be added, before or after.
  /// InvalidArgument: a stamp before that of the last place, or what Localizer::Localize refuses.
  [[nodiscard]] absl::StatusOr<LoopAnswer> Query(PointView scan, std::int64_t stamp_ns,
                                                 const SearchControl& control = {});
  [[nodiscard]] absl::StatusOr<LoopAnswer> Query(const ScanDescriptor& scan, std::int64_t stamp_ns,
                                                 const SearchControl& control = {});

  /// Where the SLAM takes all places to be after it has closed a loop: one T_map_place each, in the
  /// order added. Two places at one spot whose poses contradict each other make further scans there
  /// `ambiguous`, so tell it. O(n log n).
  [[nodiscard]] absl::Status MovePlaces(std::span<const Pose> T_map_place);

  /// Added so far, those in the window included.
  [[nodiscard]] std::size_t num_places() const { return map_->places.size() + waiting_.size(); }
  /// Where a place is, as it was told last, its rotation made exact. i in [0, num_places()).
  [[nodiscard]] const Pose& T_map_place(std::size_t i) const {
    return i < map_->places.size() ? map_->places[i].T_map_place
                                   : waiting_[i - map_->places.size()].place.T_map_place;
  }
  [[nodiscard]] const Params& params() const { return options_.params; }

 private:
  /// A place in the window.
  struct Waiting {
    Place place;
    PlaceDescriptor descriptor;
  };

  LoopDetector(const LoopDetectorOptions& options, Describer describer);

  /// Lets the places out of the window that are old enough.
  [[nodiscard]] absl::Status LetOut(std::int64_t now_ns);
  [[nodiscard]] absl::Status CheckStamp(std::int64_t stamp_ns) const;

  LoopDetectorOptions options_;
  Describer describer_;
  std::shared_ptr<Map> map_;  // of the places outside the window
  std::shared_ptr<Localizer> localizer_;
  std::deque<Waiting> waiting_;  // oldest first
  std::optional<std::int64_t> last_stamp_ns_;
};

}  // namespace scanloc

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc::mapdb {

/// One scan that is to become a place.
struct PlannedScan {
  std::string name;  ///< the scan's file name; at most limits::kMaxNameBytes
  std::int64_t stamp_ns = 0;
  Pose T_map_place = Pose::Identity();
};

/// A drive as it is to be built: its scans in order, after those too near to each other were taken
/// out. A build that is resumed must be given the same plan again.
struct SessionPlan {
  std::string name;  ///< unique in the map
  std::vector<PlannedScan> scans;
};

/// OK, or InvalidArgument: no name, a name too long or not UTF-8, no scan, too many, or a pose that
/// is not rigid; names the scan.
[[nodiscard]] absl::Status Validate(const SessionPlan& plan);

/// Why a scan becomes no place; both are counted in the session.
enum class SkipReason {
  kEmpty,       ///< no point in range
  kUnreadable,  ///< its file could not be read
};

/// Writes the places of one session into a map file, in the order of the plan.
///
/// While a builder is open no other can write the file (it gets Unavailable); readers see the last
/// commit. A process killed at any moment leaves the file as the last Commit left it. After an
/// error the builder refuses further work; everything committed is kept, and Resume goes on there.
/// ResourceExhausted: the disk is full, or the map would exceed limits.hpp. Not thread-safe.
class MapBuilder {
 public:
  /// Starts a map. AlreadyExists if there is a file; InvalidArgument for bad parameters or plan;
  /// NotFound if the folder does not exist.
  [[nodiscard]] static absl::StatusOr<MapBuilder> Create(const std::string& path,
                                                         const Params& params, SessionPlan plan);

  /// Starts a further session with the parameters of the map. AlreadyExists if it has one of that
  /// name; FailedPrecondition if its last session is unfinished; the errors of map_file.hpp.
  [[nodiscard]] static absl::StatusOr<MapBuilder> Append(const std::string& path, SessionPlan plan);

  /// Goes on with the unfinished session, behind its last committed scan; a session that is
  /// finished stays as it is, and a file that does not exist is created. FailedPrecondition, naming
  /// the difference, if the parameters or the plan are not those of the file's last session.
  [[nodiscard]] static absl::StatusOr<MapBuilder> Resume(const std::string& path,
                                                         const Params& params, SessionPlan plan);

  MapBuilder(MapBuilder&&) noexcept;
  MapBuilder& operator=(MapBuilder&&) noexcept;
  ~MapBuilder();  ///< what was not committed is lost

  [[nodiscard]] const Params& params() const;  ///< of the map
  [[nodiscard]] const SessionPlan& plan() const;

  /// Index in the plan of the scan that comes next; plan().scans.size() once all are done.
  [[nodiscard]] std::size_t next_scan() const;
  /// Places of all sessions, those not yet committed included.
  [[nodiscard]] std::int64_t num_places() const;

  /// Makes the next scan a place. InvalidArgument if the descriptor has not the shapes of params().
  [[nodiscard]] absl::Status Add(const PlaceDescriptor& descriptor);

  /// Passes over the next scan.
  [[nodiscard]] absl::Status Skip(SkipReason reason);

  /// Makes everything so far durable. Memory grows with what is not committed.
  [[nodiscard]] absl::Status Commit();

  /// Commits and gives the content id. FailedPrecondition if scans of the plan are left.
  [[nodiscard]] absl::StatusOr<std::string> Finish();

 private:
  struct State;
  explicit MapBuilder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace scanloc::mapdb

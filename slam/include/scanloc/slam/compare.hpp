#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/slam/close_loops.hpp"

/// What of a world has changed between two visits that share one frame.
namespace scanloc::slam {

/// What was seen from one spot.
struct Observation {
  std::string name;     ///< of the scan
  std::string session;  ///< of a map; empty of a drive
  Pose T_map_scan = Pose::Identity();
  Structure structure;
};

enum class Change : std::uint8_t {
  kSame,     ///< the other visit sees the same
  kChanged,  ///< it sees something else
  kUnseen,   ///< it was not there, or saw too little to say
};
/// `same`, `changed` or `unseen`.
[[nodiscard]] const char* ChangeName(Change change);

struct Comparison {
  Change change = Change::kUnseen;
  double agreement = 0.0;  ///< share of the structure that lies on that of the other, [0, 1]
  std::optional<std::size_t> other;  ///< the observation that agrees best
};

/// Of each of `seen`, whether `others` see the same there. Observations of one visit that follow
/// each other within some metres are judged together, so that a lorry is no change; beside a clear
/// change less disagreement is one, too.
///
/// Depends on the observations alone, not on the number of threads. Of the structures both must be
/// of these parameters. ResourceExhausted: no thread could be started.
[[nodiscard]] absl::StatusOr<std::vector<Comparison>> Compare(std::span<const Observation> seen,
                                                              std::span<const Observation> others,
                                                              const AutoParams& params,
                                                              int num_threads);

/// The places of a map file. FailedPrecondition: it has no structures. Else the errors of
/// map_file.hpp.
[[nodiscard]] absl::StatusOr<std::vector<Observation>> ObserveMap(const std::string& path);

/// The scans of a drive, at the spacing; `scans` gets their numbers in the plan. Errors as of
/// CloseLoops.
[[nodiscard]] absl::StatusOr<std::vector<Observation>> ObserveDrive(
    const Params& params, const mapdb::SessionPlan& plan, const mapdb::ScanLoader& load_scan,
    const DriveOptions& options, std::vector<std::size_t>& scans);

}  // namespace scanloc::slam

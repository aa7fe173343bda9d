#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "scanloc/core/auto_params.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/structure.hpp"

/// Whether the poses of a drive agree with what its scans show. Pure functions; thread-safe.
namespace scanloc {

/// Two scans that were taken shortly after each other, and their poses by the drive.
struct ScanPair {
  std::size_t first = 0;  ///< index of the first scan in the drive
  std::size_t second = 0;
  Structure first_structure;
  Structure second_structure;
};

/// How the scans of a pair lie on each other.
struct PairCheck {
  enum class Verdict {
    kSilent,       ///< too little to see, or nothing that lies on each other
    kAgrees,       ///< the scans lie on each other as the poses say, or no worse than otherwise
    kContradicts,  ///< they lie on each other well, but elsewhere
    kStrangers,    ///< near each other by the poses, with much to see, and not alike
  };
  std::size_t first = 0;
  std::size_t second = 0;
  Verdict verdict = Verdict::kSilent;
  double score = 0.0;             ///< of the best registration, as Hypothesis::score
  Pose told = Pose::Identity();   ///< T_first_second by the poses
  Pose shown = Pose::Identity();  ///< T_first_second as the scans lie on each other best
  /// All T_first_second found at which they lie as well, `shown` first: in a tunnel and among even
  /// pillars several; looked for around it where `told` is elsewhere. None where they lie nowhere
  /// well.
  std::vector<Pose> as_good;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of the ground, in the first sensor's frame
};

/// Both scans must have been described with these parameters, which are valid.
[[nodiscard]] PairCheck CheckPair(const ScanPair& pair, const Pose& T_map_first,
                                  const Pose& T_map_second, const AutoParams& params);

/// What the pairs of a drive say together.
struct ConsistencyReport {
  std::size_t num_agreeing = 0;
  std::size_t num_contradicting = 0;
  std::size_t num_strangers = 0;
  bool is_inconsistent = false;
  std::string likely_cause;  ///< for a person; empty where the drive is consistent
};

/// `poses` are T_map_sensor of all scans of the drive, which the pairs index. A drive is
/// inconsistent where at least kMinContradictions pairs, and more than a twelfth of those that say
/// anything, speak against the poses; and where the motions of the poses fit those that the scans
/// show clearly better with a common mistake undone: other units, axes, order of numbers or files,
/// a sensor that is turned on its body, poses of the scans some time before or after.
[[nodiscard]] ConsistencyReport JudgeDrive(std::span<const PairCheck> checks,
                                           std::span<const Pose> poses);
inline constexpr std::size_t kMinContradictions = 4;

/// First scans of at most max_pairs pairs of successive ones of these that are worth a look: most
/// of them evenly over the drive, a quarter where it begins or ends to turn. Ascending.
[[nodiscard]] std::vector<std::size_t> PairsToCheck(std::span<const Pose> poses,
                                                    std::size_t max_pairs);

}  // namespace scanloc

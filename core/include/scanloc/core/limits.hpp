#pragma once

#include <cstddef>
#include <cstdint>

/// Bounds on what a file or the network may ask for, where several modules know them.
namespace scanloc::limits {

/// Most points of one scan; a 128-ray sensor gives at most 0.3 million.
inline constexpr std::size_t kMaxPointsPerScan = 4'000'000;
/// Largest scan file that is read; above it the file cannot be one scan of kMaxPointsPerScan.
inline constexpr std::int64_t kMaxScanFileBytes = 512LL << 20;
/// Coordinates beyond this are no LiDAR return and are skipped like points that are not finite [m].
inline constexpr float kMaxCoordinate_m = 4096.0F;
/// Farthest from the origin of the map frame that a pose may lie [m]; UTM and ECEF coordinates fit.
inline constexpr double kMaxTranslation_m = 1.0e8;
/// Most rows or columns of a descriptor.
inline constexpr int kMaxDescriptorSide = 720;
/// Most root shifts of the augmented polar context.
inline constexpr int kMaxRootShifts = 16;
/// Most candidates of one query.
inline constexpr int kMaxCandidates = 1000;
/// Most sessions that a prior names.
inline constexpr std::size_t kMaxPriorSessions = 1000;
/// Most places of one map.
inline constexpr std::int64_t kMaxPlaces = 10'000'000;
/// Most sessions of one map.
inline constexpr std::int64_t kMaxSessions = 100'000;
/// Longest name of a session, a map or a scan [bytes].
inline constexpr std::size_t kMaxNameBytes = 255;
/// Largest message on the wire: kMaxPointsPerScan packed points and room to spare [bytes].
inline constexpr int kMaxMessageBytes = 64 << 20;

}  // namespace scanloc::limits

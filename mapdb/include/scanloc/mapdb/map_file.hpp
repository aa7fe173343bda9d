#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/history.hpp"

/// The map file (docs/map_format.md): one SQLite database, by convention named *.scanloc.
///
/// Every function here but RecoverMap only reads: it writes and deletes nothing, whatever lies
/// beside the file. May be called from any thread.
///
/// Whatever was done to a file, a call gives either exactly what was written or one of
///   NotFound            no such file
///   InvalidArgument     a directory, not SQLite, or the database of another application
///   FailedPrecondition  written by a newer version; or a journal lies beside the file, in most
///                       cases the unfinished write of a build that was killed: see RecoverMap
///   DataLoss            truncated or damaged: a checksum, the schema or an invariant does not hold
///   Unavailable         a build kept the file locked for longer than a few seconds
///   PermissionDenied    the rights to the file or its folder do not allow it
///   ResourceExhausted   over one of limits.hpp
///   DeadlineExceeded    it takes longer to read than any sound map of its size on a slow disk
namespace scanloc::mapdb {

/// One drive in a map.
struct SessionInfo {
  std::string name;
  std::int64_t num_scans = 0;       ///< planned
  std::int64_t num_places = 0;      ///< built so far
  std::int64_t num_empty = 0;       ///< scans without a point in range: no place
  std::int64_t num_unreadable = 0;  ///< scans passed over because they could not be read
  std::int64_t first_stamp_ns = 0;  ///< of its places; 0 where it has none
  std::int64_t last_stamp_ns = 0;

  /// False: the build was stopped before its last scan, and can be resumed.
  [[nodiscard]] bool complete() const {
    return num_places + num_empty + num_unreadable == num_scans;
  }
};

/// What a map file says of itself.
struct FileInfo {
  int schema_version = 0;
  int compatible_version = 0;  ///< oldest schema version whose readers can read the file
  std::string built_by;        ///< program and version that created the file
  std::string content_id;      ///< as in Map
  bool complete = false;       ///< every session is
  Params params;
  std::vector<SessionInfo> sessions;
  std::int64_t num_scans = 0;  ///< sums over the sessions
  std::int64_t num_places = 0;
  std::int64_t num_empty = 0;
  std::int64_t num_unreadable = 0;
  std::int64_t first_stamp_ns = 0;
  std::int64_t last_stamp_ns = 0;
  Eigen::AlignedBox3d
      extent_m;  ///< of the positions of the places, map frame; isEmpty() without any
  std::int64_t file_bytes = 0;
  std::optional<Calibration> calibration;  ///< none: not calibrated since it last grew
  std::vector<ConfusablePair> confusable;  ///< worst first; empty where it is not calibrated
  std::string calibration_id;              ///< as in Map
  std::vector<HistoryEntry> history;       ///< oldest first; empty: built from scans alone
  std::optional<GeoOrigin> geo_origin;     ///< where on earth its frame stands, if that was told
};

/// One place as the file holds it, without its contexts.
struct PlaceRecord {
  Place place;
  std::string scan;              ///< name of the scan it was made of
  std::uint32_t num_voxels = 0;  ///< as in PlaceDescriptor
};

/// The whole map, ready for Localizer::Create. Every checksum is checked and the content id
/// recomputed. An incomplete map gives what was committed.
[[nodiscard]] absl::StatusOr<Map> LoadMap(const std::string& path);

/// Contexts and structures that were read last, of as many maps as are opened with it, within a
/// number of bytes; at least what one query looks at is held beside it. Thread-safe.
class PayloadCache;
[[nodiscard]] std::shared_ptr<PayloadCache> MakePayloadCache(std::int64_t max_bytes);
[[nodiscard]] std::int64_t HeldBytes(const PayloadCache& cache);

struct OpenOptions {
  std::shared_ptr<PayloadCache> cache = nullptr;  ///< null: nothing is kept
  /// A file of at most so many bytes is loaded as a whole, as LoadMap does it.
  std::int64_t whole_bytes = 0;
  /// Threads that read at once, each with a connection of its own; 0: one a processor. One more
  /// waits until one is done. At most 64.
  int num_readers = 0;
  /// A map that is in memory, such as the one that the file's takes the place of: keys and bearings
  /// that are equal are held once (Map::ShareWith). They are read and checked as without it.
  const Map* before = nullptr;
};

/// The map without its contexts and structures, ready for Localizer::Create: those of candidates
/// are read from the file when they are asked for, and compared with their checksums then; the
/// answers are the same as with LoadMap, bit for bit. All else is checked here, the content id
/// recomputed; Map::payload->Scrub checks the rest. A file of a schema before 5 is loaded as
/// LoadMap does it.
///
/// The file stays open. It may be appended to, replaced by another or removed meanwhile; rows that
/// are changed in place are DataLoss when they are read.
[[nodiscard]] absl::StatusOr<Map> OpenMap(const std::string& path, const OpenOptions& options = {});

/// What the file says of itself; does not read the contexts, so damage to them goes unseen.
[[nodiscard]] absl::StatusOr<FileInfo> ReadInfo(const std::string& path);

/// All places in the order built; does not read the contexts.
[[nodiscard]] absl::StatusOr<std::vector<PlaceRecord>> ReadPlaces(const std::string& path);

/// Gives visit(place, descriptor) each place in the order built, each checked, until it returns an
/// error. Holds one descriptor at a time.
[[nodiscard]] absl::Status VisitDescriptors(
    const std::string& path,
    const std::function<absl::Status(std::size_t place, const PlaceDescriptor&)>& visit);

/// Most lines that FindProblems gives.
inline constexpr std::size_t kMaxProblems = 100;

/// Checks the whole file and tells everything that is damaged, a line each; none: it is sound.
///
/// Checks SQLite's own structure, schema, checksums, parameters, sessions, poses, shapes and
/// heights of contexts, keys against cells, and the content id. At most kMaxProblems lines.
/// An error only where there is nothing to check: no file, not a map, or a newer one.
[[nodiscard]] absl::StatusOr<std::vector<std::string>> FindProblems(const std::string& path);

enum class Recovery : std::uint8_t {
  kNothingToDo,     ///< no unfinished write
  kRolledBack,      ///< it was undone: the file is as its last commit left it
  kJournalRemoved,  ///< the file is sound without that, and was left as it is
};

/// Ends the unfinished write that a killed build left beside the file: undoes it, unless the file
/// is sound as it is, as one is that was put in the place of that build's. Reads the whole file
/// then.
///
/// Unavailable: a build has the file. FailedPrecondition: the journal is none of a build.
/// InvalidArgument: no map. PermissionDenied. A file that does not exist is NotFound.
[[nodiscard]] absl::StatusOr<Recovery> RecoverMap(const std::string& path);

}  // namespace scanloc::mapdb

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "scanloc/core/map/map.hpp"

struct XXH3_state_s;

namespace scanloc::mapdb {

/// XXH3 over values in the file's canonical form: integers as 8 bytes, little-endian; text and
/// blobs as their length, so written, and their bytes.
class Hasher {
 public:
  Hasher();
  Hasher(Hasher&&) noexcept;
  Hasher& operator=(Hasher&&) noexcept;
  ~Hasher();

  Hasher& Add(std::int64_t value);
  Hasher& Add(std::string_view text);
  Hasher& Add(std::span<const std::byte> blob);
  Hasher& Add(double value);  ///< its bits as an integer

  /// Of all that was added; more may be added after it.
  [[nodiscard]] std::int64_t Digest64() const;
  [[nodiscard]] std::string Digest128() const;  ///< 32 hex digits
  void Reset();

 private:
  struct Free {
    void operator()(XXH3_state_s* state) const;
  };
  std::unique_ptr<XXH3_state_s, Free> state_;
};

/// Rows of the tables of a map file.
struct SessionRow {
  std::string name;
  std::string plan_hash;
  std::int64_t num_scans = 0;
  std::int64_t num_places = 0;
  std::int64_t num_empty = 0;
  std::int64_t num_unreadable = 0;

  [[nodiscard]] std::int64_t num_done() const { return num_places + num_empty + num_unreadable; }
};
struct PlaceRow {
  std::int64_t id = 0;
  std::int64_t session = 0;
  std::int64_t stamp_ns = 0;
  Bytes pose;
  std::string scan;
  std::int64_t num_voxels = 0;
  std::int64_t checksum = 0;
};
struct ContextRow {
  std::int64_t id = 0;
  std::int64_t place = 0;
  std::int64_t kind = 0;
  std::int64_t variant = 0;
  std::span<const std::byte> retrieval_key;
  std::span<const std::byte> aligning_key;
  std::span<const std::byte> cells;
  std::int64_t checksum = 0;
};

struct StructureRow {
  std::int64_t place = 0;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double height_m = 0.0;
  std::span<const std::byte> posts;
  std::int64_t checksum = 0;
};
struct KeysRow {
  std::int64_t place = 0;
  double roll_rad = 0.0;  ///< as in the structure; zeros where there is none
  double pitch_rad = 0.0;
  double height_m = 0.0;
  std::int64_t num_posts = 0;
  std::span<const std::byte> retrieval_keys;  ///< of the contexts in order, one behind the other
  std::span<const std::byte> checksums;       ///< of the contexts in order and of the structure
  std::int64_t checksum = 0;
};
struct BearingsRow {
  std::int64_t place = 0;
  std::span<const std::byte> rings;
  std::int64_t checksum = 0;
};
struct CalibrationRow {
  std::string content_id;  ///< of the map that it was made for
  Calibration calibration;
  std::int64_t num_confusable = 0;
};

/// What must stand in the rows' checksum columns.
[[nodiscard]] std::int64_t MetaChecksum(std::string_view key, std::string_view value);
[[nodiscard]] std::int64_t ParamChecksum(std::string_view name, std::string_view value);
[[nodiscard]] std::int64_t SessionChecksum(std::int64_t id, const SessionRow& row);
[[nodiscard]] std::int64_t ContextChecksum(const ContextRow& row, Hasher& scratch);
[[nodiscard]] std::int64_t StructureChecksum(const StructureRow& row, Hasher& scratch);
[[nodiscard]] std::int64_t KeysChecksum(const KeysRow& row, Hasher& scratch);
[[nodiscard]] std::int64_t BearingsChecksum(const BearingsRow& row, Hasher& scratch);
[[nodiscard]] std::int64_t CalibrationChecksum(const CalibrationRow& row);
[[nodiscard]] std::int64_t ConfusableChecksum(std::int64_t id, const ConfusablePair& pair);
/// The calibration id, 16 hex digits: what a calibration says, whatever map it was made for.
[[nodiscard]] std::string CalibrationId(const Calibration& calibration,
                                        std::span<const ConfusablePair> confusable);
/// That of a place covers its contexts and its structure: start with StartPlaceChecksum, add the
/// checksum of each.
void StartPlaceChecksum(const PlaceRow& row, Hasher& hasher);

/// The content id: parameters, then each session followed by its places, in order. Neither time,
/// tool, plan nor layout of the file enters, so the same input always gives the same id.
class ContentHasher {
 public:
  explicit ContentHasher(const ParamTexts& params);
  /// Adds the sessions before index `end` that were not added yet: those up to a place's own before
  /// the place, and all at the end.
  void AddSessionsBefore(std::size_t end, const std::vector<SessionRow>& sessions);
  void AddPlace(const PlaceRow& row);
  [[nodiscard]] std::string ContentId() const { return hasher_.Digest128(); }

 private:
  Hasher hasher_;
  std::size_t num_sessions_ = 0;
};

}  // namespace scanloc::mapdb

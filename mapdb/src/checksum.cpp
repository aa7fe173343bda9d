#include "checksum.hpp"

#include <xxhash.h>

#include <bit>

#include "scanloc/core/byte_order.hpp"

namespace scanloc::mapdb {

void Hasher::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

Hasher::Hasher() : state_(XXH3_createState()) { Reset(); }
Hasher::Hasher(Hasher&&) noexcept = default;
Hasher& Hasher::operator=(Hasher&&) noexcept = default;
Hasher::~Hasher() = default;

Hasher& Hasher::Add(std::int64_t value) {
  std::byte bytes[sizeof(value)];
  StoreLittleEndian(value, bytes);
  XXH3_128bits_update(state_.get(), bytes, sizeof(bytes));
  return *this;
}

Hasher& Hasher::Add(std::string_view text) { return Add(std::as_bytes(std::span(text))); }

Hasher& Hasher::Add(std::span<const std::byte> blob) {
  Add(static_cast<std::int64_t>(blob.size()));
  XXH3_128bits_update(state_.get(), blob.data(), blob.size());
  return *this;
}

Hasher& Hasher::Add(double value) { return Add(std::bit_cast<std::int64_t>(value)); }

std::int64_t Hasher::Digest64() const {
  return static_cast<std::int64_t>(XXH3_64bits_digest(state_.get()));
}

std::string Hasher::Digest128() const {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state_.get()));
  std::string text;
  for (const std::uint8_t byte : canonical.digest) {
    constexpr char kDigits[] = "0123456789abcdef";
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

void Hasher::Reset() { XXH3_128bits_reset(state_.get()); }

std::int64_t MetaChecksum(std::string_view key, std::string_view value) {
  return Hasher().Add("meta").Add(key).Add(value).Digest64();
}

std::int64_t ParamChecksum(std::string_view name, std::string_view value) {
  return Hasher().Add("params").Add(name).Add(value).Digest64();
}

std::int64_t SessionChecksum(std::int64_t id, const SessionRow& row) {
  return Hasher()
      .Add("sessions")
      .Add(id)
      .Add(row.name)
      .Add(row.plan_hash)
      .Add(row.num_scans)
      .Add(row.num_places)
      .Add(row.num_empty)
      .Add(row.num_unreadable)
      .Digest64();
}

std::int64_t ContextChecksum(const ContextRow& row, Hasher& scratch) {
  scratch.Reset();
  return scratch.Add("contexts")
      .Add(row.id)
      .Add(row.place)
      .Add(row.kind)
      .Add(row.variant)
      .Add(row.retrieval_key)
      .Add(row.aligning_key)
      .Add(row.cells)
      .Digest64();
}

std::int64_t StructureChecksum(const StructureRow& row, Hasher& scratch) {
  scratch.Reset();
  return scratch.Add("structures")
      .Add(row.place)
      .Add(row.roll_rad)
      .Add(row.pitch_rad)
      .Add(row.height_m)
      .Add(row.posts)
      .Digest64();
}

std::int64_t KeysChecksum(const KeysRow& row, Hasher& scratch) {
  scratch.Reset();
  return scratch.Add("keys")
      .Add(row.place)
      .Add(row.roll_rad)
      .Add(row.pitch_rad)
      .Add(row.height_m)
      .Add(row.num_posts)
      .Add(row.retrieval_keys)
      .Add(row.checksums)
      .Digest64();
}

std::int64_t BearingsChecksum(const BearingsRow& row, Hasher& scratch) {
  scratch.Reset();
  return scratch.Add("bearings").Add(row.place).Add(row.rings).Digest64();
}

std::int64_t CalibrationChecksum(const CalibrationRow& row) {
  return Hasher()
      .Add("calibration")
      .Add(row.content_id)
      .Add(row.calibration.bias)
      .Add(row.calibration.score_weight)
      .Add(row.calibration.margin_weight)
      .Add(std::int64_t{row.calibration.num_trials})
      .Add(row.num_confusable)
      .Digest64();
}

std::int64_t ConfusableChecksum(std::int64_t id, const ConfusablePair& pair) {
  return Hasher()
      .Add("confusable")
      .Add(id)
      .Add(std::int64_t{pair.place})
      .Add(std::int64_t{pair.lookalike})
      .Add(pair.confidence)
      .Digest64();
}

std::string CalibrationId(const Calibration& calibration,
                          std::span<const ConfusablePair> confusable) {
  Hasher hasher;
  hasher.Add("calibration id")
      .Add(calibration.bias)
      .Add(calibration.score_weight)
      .Add(calibration.margin_weight)
      .Add(std::int64_t{calibration.num_trials});
  for (const ConfusablePair& pair : confusable) {
    hasher.Add(std::int64_t{pair.place}).Add(std::int64_t{pair.lookalike}).Add(pair.confidence);
  }
  return absl::StrCat(absl::Hex(hasher.Digest64(), absl::kZeroPad16));
}

void StartPlaceChecksum(const PlaceRow& row, Hasher& hasher) {
  hasher.Reset();
  hasher.Add("places")
      .Add(row.id)
      .Add(row.session)
      .Add(row.stamp_ns)
      .Add(row.pose)
      .Add(row.scan)
      .Add(row.num_voxels);
}

ContentHasher::ContentHasher(const ParamTexts& params) {
  hasher_.Add("scanloc map 1").Add(static_cast<std::int64_t>(params.size()));
  for (const auto& [name, value] : params) {
    hasher_.Add(name).Add(value);
  }
}

void ContentHasher::AddSessionsBefore(std::size_t end, const std::vector<SessionRow>& sessions) {
  for (; num_sessions_ < end; ++num_sessions_) {
    hasher_.Add("session").Add(sessions[num_sessions_].name);
  }
}

void ContentHasher::AddPlace(const PlaceRow& row) {
  hasher_.Add("place")
      .Add(row.session)
      .Add(row.stamp_ns)
      .Add(row.pose)
      .Add(row.scan)
      .Add(row.num_voxels)
      .Add(row.checksum);
}

}  // namespace scanloc::mapdb

#include "scan_context/key_distance.hpp"

#include "scan/simd.hpp"

namespace scanloc {
namespace {

struct KeySums {
  std::int64_t product = 0;  // of a key and another
  std::int64_t square = 0;   // of the other
};

/// Below 2^53 for any contexts, so that they are exact as floating point, too.
template <typename Sum>
inline KeySums AddUpKeys(std::span<const std::int32_t> key_cm, const Sum* other_cm) {
  KeySums sums;
  for (std::size_t i = 0; i < key_cm.size(); ++i) {
    const std::int64_t other = other_cm[i];
    sums.product += key_cm[i] * other;
    sums.square += other * other;
  }
  return sums;
}

SCANLOC_SIMD KeySums SumsOf(std::span<const std::int32_t> key_cm, const std::uint16_t* other_cm) {
  return AddUpKeys(key_cm, other_cm);
}

}  // namespace

KeyDistance::KeyDistance(std::span<const std::int32_t> key_cm)
    : key_cm_(key_cm.begin(), key_cm.end()),
      reversed_cm_(key_cm.rbegin(), key_cm.rend()),
      square_cm2_(AddUpKeys(key_cm, key_cm.data()).square) {}

double KeyDistance::Squared(const ContextTable& table, std::size_t entry) const {
  const ContextTable::HeldKey held = table.held_retrieval_key(entry);
  KeySums sums;
  if (held.cm.empty()) {
    sums = AddUpKeys(key_cm_, table.retrieval_key_cm(entry).data());
  } else {
    // A key is as far from a reversed one as the reversed key from that.
    sums = SumsOf(held.is_reversed ? reversed_cm_ : key_cm_, held.cm.data());
  }
  return static_cast<double>(square_cm2_ - 2 * sums.product + sums.square) * 1e-4;
}

}  // namespace scanloc

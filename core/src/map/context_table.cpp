#include "scanloc/core/map/context_table.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "scanloc/core/map/map.hpp"

namespace scanloc {
namespace {

constexpr int kPlaceBits = 24;

}  // namespace

Keys MakeKeys(const Context& context) {
  Keys keys;
  keys.retrieval_cm.resize(static_cast<std::size_t>(context.num_rows));
  keys.aligning_cm.resize(static_cast<std::size_t>(context.num_cols));
  const std::uint16_t* cell = context.cells_cm.data();
  for (std::int32_t& column_sum_cm : keys.aligning_cm) {
    for (std::int32_t& row_sum_cm : keys.retrieval_cm) {
      row_sum_cm += *cell;
      column_sum_cm += *cell;
      ++cell;
    }
  }
  return keys;
}

void ContextTable::Reserve(std::size_t num_entries, bool with_contexts) {
  if (!with_contexts) return;
  cells_cm_.reserve(num_entries * num_cells());
  aligning_cm_.reserve(num_entries * static_cast<std::size_t>(num_cols_));
}

void ContextTable::AppendOwner(const Entry& entry) {
  assert(entry.place >= 0 && entry.place <= kMaxPlace);
  const auto same = std::find_if(variants_.begin(), variants_.end(), [&](const Entry& variant) {
    return variant.root_shift_m == entry.root_shift_m && variant.flipped == entry.flipped &&
           variant.augmented == entry.augmented;
  });
  const auto number = static_cast<std::uint32_t>(same - variants_.begin());
  assert(number < kMaxVariants);
  const bool is_new = same == variants_.end();
  const std::uint32_t owner = static_cast<std::uint32_t>(entry.place) | number << kPlaceBits;
  if (owners_.empty()) {
    // A new variant is in order at place 0 alone.
    const bool is_next = is_new ? entry.place == 0 && number == size_ : owner == OwnerOf(size_);
    if (!is_next) {
      std::vector<std::uint32_t> owners;
      for (std::size_t i = 0; i < size_; ++i) owners.push_back(OwnerOf(i));
      owners_ = std::move(owners);
      owners_.push_back(owner);
    }
  } else {
    owners_.push_back(owner);
  }
  if (is_new) {
    variants_.push_back(entry);
    variants_.back().place = 0;
  }
  ++size_;
}

void ContextTable::Append(const Entry& entry, std::span<const std::uint16_t> cells_cm,
                          std::span<const std::int32_t> retrieval_cm,
                          std::span<const std::int32_t> aligning_cm) {
  assert(cells_cm.size() == num_cells());
  assert(aligning_cm.size() == static_cast<std::size_t>(num_cols_));
  AppendKey(entry, retrieval_cm);
  cells_cm_.insert(cells_cm_.end(), cells_cm.begin(), cells_cm.end());
  aligning_cm_.insert(aligning_cm_.end(), aligning_cm.begin(), aligning_cm.end());
}

void ContextTable::AppendKey(const Entry& entry, std::span<const std::int32_t> retrieval_cm) {
  assert(retrieval_cm.size() == static_cast<std::size_t>(num_rows_));
  constexpr std::int32_t kMost = std::numeric_limits<std::uint16_t>::max();
  const bool fits = std::all_of(retrieval_cm.begin(), retrieval_cm.end(),
                                [](std::int32_t sum_cm) { return sum_cm >= 0 && sum_cm <= kMost; });
  assert(!has_flips() || size() == 2 * num_flips_);
  AppendOwner(entry);
  KeyBlock& block = keys_.last();
  if (!fits) {
    block.large_cm[keys_.num_in_last()].assign(retrieval_cm.begin(), retrieval_cm.end());
  }
  for (const std::int32_t sum_cm : retrieval_cm) {
    block.cm.push_back(static_cast<std::uint16_t>(sum_cm));
  }
  keys_.Appended(BlockHash(retrieval_cm));
}

void ContextTable::AppendFlipOfLast() {
  assert(size() == 2 * num_flips_ + 1);
  Entry flip = entry(size() - 1);
  flip.flipped = !flip.flipped;
  flip.augmented = true;
  const bool has_context = holds_contexts();
  AppendOwner(flip);
  ++num_flips_;
  if (!has_context) return;
  // Columns of rows in one run: flipping both axes is reversing the run, and likewise the keys.
  const auto append_reversed = [](auto& values, std::size_t count) {
    values.resize(values.size() + count);
    const auto end = values.end() - static_cast<std::ptrdiff_t>(count);
    std::reverse_copy(end - static_cast<std::ptrdiff_t>(count), end, end);
  };
  append_reversed(cells_cm_, num_cells());
  append_reversed(aligning_cm_, static_cast<std::size_t>(num_cols_));
}

std::uint32_t ContextTable::OwnerOf(std::size_t i) const {
  if (!owners_.empty()) return owners_[i];
  const auto number = static_cast<std::uint32_t>(i);
  const auto num_variants = static_cast<std::uint32_t>(variants_.size());
  return number / num_variants | number % num_variants << kPlaceBits;
}

ContextTable::Entry ContextTable::entry(std::size_t i) const {
  const std::uint32_t owner = OwnerOf(i);
  Entry entry = variants_[owner >> kPlaceBits];
  entry.place = static_cast<std::int32_t>(owner & kMaxPlace);
  return entry;
}

ContextView ContextTable::context(std::size_t i) const {
  const auto num_cols = static_cast<std::size_t>(num_cols_);
  return {num_rows_, num_cols_, std::span(cells_cm_).subspan(i * num_cells(), num_cells()),
          std::span(aligning_cm_).subspan(i * num_cols, num_cols)};
}

std::vector<std::int32_t> ContextTable::retrieval_key_cm(std::size_t i) const {
  std::vector<std::int32_t> key_cm(static_cast<std::size_t>(num_rows_));
  ReadRetrievalKey(i, key_cm);
  return key_cm;
}

void ContextTable::ReadRetrievalKey(std::size_t i, std::span<std::int32_t> key_cm) const {
  const HeldKey held = held_retrieval_key(i);
  if (held.cm.empty() && num_rows_ > 0) {
    const auto [block, index] = keys_.at(NumberOf(i));
    std::ranges::copy(block->large_cm.at(index), key_cm.begin());
  } else {
    std::ranges::copy(held.cm, key_cm.begin());
  }
  if (held.is_reversed) std::reverse(key_cm.begin(), key_cm.end());
}

ContextTable::HeldKey ContextTable::held_retrieval_key(std::size_t i) const {
  const auto [block, index] = keys_.at(NumberOf(i));
  HeldKey held{.cm = {}, .is_reversed = has_flips() && i % 2 == 1};
  if (!block->large_cm.empty() && block->large_cm.contains(index)) return held;
  const auto num_rows = static_cast<std::size_t>(num_rows_);
  held.cm = std::span(block->cm).subspan(index * num_rows, num_rows);
  return held;
}

Map MakeEmptyMap(const Params& params) {
  Map map;
  map.params = params;
  map.polar = ContextTable(params.polar.num_rings, params.polar.num_sectors);
  map.cart = ContextTable(params.cart.num_rows, params.cart.num_cols);
  return map;
}

BearingGrid BearingsOf(std::span<const Post> posts, const Params& params) {
  return BearingGrid(posts, params.automatic.shortlist.bearing_ring_m).Widened();
}

void Map::AppendStructure(Structure structure) {
  grounds.push_back({structure.ground(), !structure.posts.empty()});
  bearings.push_back(BearingsOf(structure.posts, params));
  structures.push_back(std::move(structure));
}

void Map::ShareWith(const Map& other) {
  polar.ShareKeysWith(other.polar);
  cart.ShareKeysWith(other.cart);
  bearings.ShareWith(other.bearings);
}

void Map::AppendDescriptor(std::int32_t place, const PlaceDescriptor& descriptor) {
  const auto append = [place](ContextTable& table, const Context& context, float root_shift_m,
                              bool augmented) {
    const Keys keys = MakeKeys(context);
    table.Append({place, root_shift_m, false, augmented}, context.cells_cm, keys.retrieval_cm,
                 keys.aligning_cm);
  };
  for (std::size_t v = 0; v < descriptor.polar.size(); ++v) {
    const double shift_m = v == 0 ? 0.0 : params.polar.root_shifts_m[v - 1];
    append(polar, descriptor.polar[v], static_cast<float>(shift_m), v > 0);
  }
  if (params.structure.enabled) AppendStructure(descriptor.structure);
  if (descriptor.cart.empty()) return;
  append(cart, descriptor.cart, 0.0F, false);
  if (params.cart.double_flip) cart.AppendFlipOfLast();
}

}  // namespace scanloc

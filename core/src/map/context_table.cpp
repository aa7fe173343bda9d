#include "scanloc/core/map/context_table.hpp"

#include <algorithm>
#include <cassert>

#include "scanloc/core/map/map.hpp"

namespace scanloc {

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

void ContextTable::Reserve(std::size_t num_entries) {
  entries_.reserve(num_entries);
  cells_cm_.reserve(num_entries * static_cast<std::size_t>(num_rows_) *
                    static_cast<std::size_t>(num_cols_));
  retrieval_cm_.reserve(num_entries * static_cast<std::size_t>(num_rows_));
  aligning_cm_.reserve(num_entries * static_cast<std::size_t>(num_cols_));
}

void ContextTable::Append(const Entry& entry, std::span<const std::uint16_t> cells_cm,
                          std::span<const std::int32_t> retrieval_cm,
                          std::span<const std::int32_t> aligning_cm) {
  assert(cells_cm.size() ==
         static_cast<std::size_t>(num_rows_) * static_cast<std::size_t>(num_cols_));
  assert(retrieval_cm.size() == static_cast<std::size_t>(num_rows_));
  assert(aligning_cm.size() == static_cast<std::size_t>(num_cols_));
  entries_.push_back(entry);
  cells_cm_.insert(cells_cm_.end(), cells_cm.begin(), cells_cm.end());
  retrieval_cm_.insert(retrieval_cm_.end(), retrieval_cm.begin(), retrieval_cm.end());
  aligning_cm_.insert(aligning_cm_.end(), aligning_cm.begin(), aligning_cm.end());
}

void ContextTable::AppendFlipOfLast() {
  assert(!entries_.empty());
  Entry entry = entries_.back();
  entry.flipped = !entry.flipped;
  entry.augmented = true;
  entries_.push_back(entry);
  // Columns of rows in one run: flipping both axes is reversing the run, and likewise the keys.
  const auto append_reversed = [](auto& values, int count) {
    values.resize(values.size() + static_cast<std::size_t>(count));
    std::reverse_copy(values.end() - 2 * count, values.end() - count, values.end() - count);
  };
  append_reversed(cells_cm_, num_rows_ * num_cols_);
  append_reversed(retrieval_cm_, num_rows_);
  append_reversed(aligning_cm_, num_cols_);
}

ContextView ContextTable::context(std::size_t i) const {
  const auto num_cells = static_cast<std::size_t>(num_rows_) * static_cast<std::size_t>(num_cols_);
  const auto num_cols = static_cast<std::size_t>(num_cols_);
  return {num_rows_, num_cols_, std::span(cells_cm_).subspan(i * num_cells, num_cells),
          std::span(aligning_cm_).subspan(i * num_cols, num_cols)};
}

std::span<const std::int32_t> ContextTable::retrieval_key_cm(std::size_t i) const {
  const auto num_rows = static_cast<std::size_t>(num_rows_);
  return std::span(retrieval_cm_).subspan(i * num_rows, num_rows);
}

Map MakeEmptyMap(const Params& params) {
  Map map;
  map.params = params;
  map.polar = ContextTable(params.polar.num_rings, params.polar.num_sectors);
  map.cart = ContextTable(params.cart.num_rows, params.cart.num_cols);
  return map;
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
  if (params.structure.enabled) structures.push_back(descriptor.structure);
  if (descriptor.cart.empty()) return;
  append(cart, descriptor.cart, 0.0F, false);
  if (params.cart.double_flip) cart.AppendFlipOfLast();
}

}  // namespace scanloc

#include "map/payload_view.hpp"

#include <utility>

namespace scanloc {
namespace {

const ContextTable& TableOf(const Map& map, DescriptorKind kind) {
  return kind == DescriptorKind::kPolar ? map.polar : map.cart;
}

constexpr PayloadId StructureId(std::size_t place) {
  return {static_cast<std::int32_t>(place), PayloadId::Part::kStructure, 0};
}

Payload FlippedOf(const Payload& payload) {
  Payload flipped;
  flipped.cells_cm.assign(payload.cells_cm.rbegin(), payload.cells_cm.rend());
  flipped.aligning_cm.assign(payload.aligning_cm.rbegin(), payload.aligning_cm.rend());
  return flipped;
}

}  // namespace

PayloadId PayloadView::IdOf(DescriptorKind kind, std::size_t entry) const {
  const std::int32_t place = TableOf(map_, kind).entry(entry).place;
  if (kind == DescriptorKind::kCart) return {place, PayloadId::Part::kCart, 0};
  const std::size_t num_each = 1 + map_.params.polar.root_shifts_m.size();
  return {place, PayloadId::Part::kPolar, static_cast<std::uint8_t>(entry % num_each)};
}

void PayloadView::Read(const std::vector<PayloadId>& ids, const SearchControl& control) {
  if (!status_.ok() || ids.empty()) return;
  std::vector<std::shared_ptr<const Payload>> payloads;
  status_ = map_.payload->Read(ids, control, payloads);
  if (!status_.ok()) return;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (payloads[i] != nullptr) held_[ids[i]] = std::move(payloads[i]);
  }
}

const Payload& PayloadView::Find(const PayloadId& id) {
  if (const auto held = held_.find(id); held != held_.end()) return *held->second;
  // Asked for by who needs it whatever the time.
  SearchControl control = control_;
  control.deadline_ns = 0;
  Read({id}, control);
  const auto held = held_.find(id);
  return held == held_.end() ? nothing_ : *held->second;
}

ContextView PayloadView::Context(DescriptorKind kind, std::size_t entry) {
  const ContextTable& table = TableOf(map_, kind);
  if (map_.payload == nullptr) return table.context(entry);
  const PayloadId id = IdOf(kind, entry);
  const Payload* payload = &Find(id);
  if (payload->cells_cm.empty()) {
    empty_cells_.resize(static_cast<std::size_t>(table.num_rows()) *
                        static_cast<std::size_t>(table.num_cols()));
    empty_key_.resize(static_cast<std::size_t>(table.num_cols()));
    return {table.num_rows(), table.num_cols(), empty_cells_,
            std::span(empty_key_).first(static_cast<std::size_t>(table.num_cols()))};
  }
  if (table.entry(entry).flipped) {
    const auto [flip, is_new] = flipped_.try_emplace(id);
    if (is_new) flip->second = FlippedOf(*payload);
    payload = &flip->second;
  }
  return {table.num_rows(), table.num_cols(), payload->cells_cm, payload->aligning_cm};
}

const Structure& PayloadView::StructureOf(std::size_t place) {
  return map_.payload == nullptr ? map_.structures[place] : Find(StructureId(place)).structure;
}

void PayloadView::WillUse(DescriptorKind kind, std::size_t entry) {
  if (map_.payload != nullptr) wanted_.push_back(IdOf(kind, entry));
}

void PayloadView::WillUseStructure(std::size_t place) {
  if (map_.payload != nullptr) wanted_.push_back(StructureId(place));
}

void PayloadView::Fetch() {
  // In the order asked for, each once.
  std::vector<PayloadId> ids;
  for (const PayloadId& id : std::exchange(wanted_, {})) {
    if (held_.try_emplace(id).second) ids.push_back(id);
  }
  Read(ids, control_);
  absl::erase_if(held_, [](const auto& held) { return held.second == nullptr; });
}

bool PayloadView::Has(DescriptorKind kind, std::size_t entry) const {
  return map_.payload == nullptr || held_.contains(IdOf(kind, entry));
}

bool PayloadView::HasStructure(std::size_t place) const {
  return map_.payload == nullptr || held_.contains(StructureId(place));
}

void PayloadView::Forget() {
  held_.clear();
  flipped_.clear();
}

}  // namespace scanloc

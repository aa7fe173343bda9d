#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "scanloc/core/map/map.hpp"
#include "scanloc/core/map/payload.hpp"

namespace scanloc {

/// Contexts and structures as one search looks at them, in memory or read from a file. What was
/// looked at stays until Forget.
///
/// What cannot be read is empty, and status() says why from then on: whoever searches must ask it
/// before anything is made of the result. Not thread-safe.
class PayloadView {
 public:
  /// Map and control must outlive it.
  PayloadView(const Map& map, const SearchControl& control) : map_(map), control_(control) {}

  [[nodiscard]] const absl::Status& status() const { return status_; }

  /// An entry of the polar or cart table.
  [[nodiscard]] ContextView Context(DescriptorKind kind, std::size_t entry);
  [[nodiscard]] const Structure& StructureOf(std::size_t place);

  /// Will be looked at: is read in one go, as far as the control's time goes.
  void WillUse(DescriptorKind kind, std::size_t entry);
  void WillUseStructure(std::size_t place);
  void Fetch();
  /// False: the time was over before it was read.
  [[nodiscard]] bool Has(DescriptorKind kind, std::size_t entry) const;
  [[nodiscard]] bool HasStructure(std::size_t place) const;

  void Forget();

 private:
  struct Hash {
    std::size_t operator()(const PayloadId& id) const {
      return absl::HashOf(id.place, id.part, id.variant);
    }
  };

  [[nodiscard]] PayloadId IdOf(DescriptorKind kind, std::size_t entry) const;
  void Read(const std::vector<PayloadId>& ids, const SearchControl& control);
  /// Empty after an error.
  [[nodiscard]] const Payload& Find(const PayloadId& id);

  const Map& map_;
  const SearchControl& control_;
  absl::Status status_;
  std::vector<PayloadId> wanted_;
  absl::flat_hash_map<PayloadId, std::shared_ptr<const Payload>, Hash> held_;
  std::map<PayloadId, Payload> flipped_;
  const Payload nothing_;
  std::vector<std::uint16_t> empty_cells_;
  std::vector<std::int32_t> empty_key_;
};

}  // namespace scanloc

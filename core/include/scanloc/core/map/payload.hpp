#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "scanloc/core/method.hpp"
#include "scanloc/core/scan/structure.hpp"
#include "scanloc/core/search_control.hpp"

namespace scanloc {

/// Which part of which place.
struct PayloadId {
  enum class Part : std::uint8_t { kPolar, kCart, kStructure };

  std::int32_t place = 0;
  Part part = Part::kStructure;
  std::uint8_t variant = 0;  ///< of the polar context: 0 the place itself, v the v-th root shift

  friend auto operator<=>(const PayloadId&, const PayloadId&) = default;
};

/// What a map holds of a place that only its candidates need: a context as it was built (not its
/// double flip), or a structure; the members of the other are empty.
struct Payload {
  std::vector<std::uint16_t> cells_cm;  ///< as in Context
  std::vector<std::int32_t> aligning_cm;
  Structure structure;
};

/// Contexts and structures that stay in a file. Any number of threads may read at once.
class PayloadReader {
 public:
  virtual ~PayloadReader() = default;

  /// Sets payloads to those of the ids, in their order. Where the control's time is over (IsOver)
  /// some may be null. DataLoss: what is read is not what was there when the map
  /// was opened. Cancelled: control.is_unwanted. Unavailable: the file cannot be read now.
  [[nodiscard]] virtual absl::Status Read(
      std::span<const PayloadId> ids, const SearchControl& control,
      std::vector<std::shared_ptr<const Payload>>& payloads) const = 0;

  /// Reads everything and compares it with what the map says of it, calling go_on with the number
  /// of places done from time to time. DataLoss: it is damaged. Cancelled: go_on said false.
  [[nodiscard]] virtual absl::Status Scrub(
      const std::function<bool(std::size_t num_done)>& go_on) const = 0;
};

}  // namespace scanloc

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"

namespace scanloc {

/// The two scan context descriptors of the paper.
enum class DescriptorKind : std::uint8_t {  // persisted, never renumber
  kPolar = 0,
  kCart = 1,
};

/// How a query is matched to a map. The paper's methods are pc, cc, a-pc and a-cc; behind any of
/// them, "-naive" aligns over every shift (eq. minImgDist) and "-brute" compares full descriptors
/// with every place (tab:bf). Both can stand together: "a-pc-naive-brute". "auto" goes beyond the
/// paper: candidates from all that the map holds, verified geometrically.
struct Method {
  bool automatic = false;  ///< "auto"; the rest says nothing then
  DescriptorKind kind = DescriptorKind::kPolar;
  bool augmented = true;  ///< candidates come from augmented keys, too
  bool naive_alignment =
      false;                 ///< every shift instead of the neighbourhood of the pre-aligned one
  bool brute_force = false;  ///< every place instead of the k-d tree's candidates

  friend bool operator==(const Method&, const Method&) = default;
};

/// InvalidArgument with the list of names if the name is none.
[[nodiscard]] absl::StatusOr<Method> ParseMethod(std::string_view name);
[[nodiscard]] std::string MethodName(const Method& method);

/// OK if a map of these parameters can serve the method, else FailedPrecondition that says why.
[[nodiscard]] absl::Status CheckServes(const Params& params, const Method& method);

/// The method of a query that names none: auto if the map holds structures, else a-pc if it has
/// polar contexts, else a-cc.
[[nodiscard]] Method DefaultMethod(const Params& params);

}  // namespace scanloc

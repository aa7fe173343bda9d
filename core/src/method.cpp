#include "scanloc/core/method.hpp"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace scanloc {

absl::StatusOr<Method> ParseMethod(std::string_view name) {
  Method method;
  if (name == "auto") {
    method.automatic = true;
    return method;
  }
  absl::string_view rest(name.data(), name.size());
  method.brute_force = absl::ConsumeSuffix(&rest, "-brute");
  method.naive_alignment = absl::ConsumeSuffix(&rest, "-naive");
  method.augmented = absl::ConsumePrefix(&rest, "a-");
  if (rest == "pc") {
    method.kind = DescriptorKind::kPolar;
  } else if (rest == "cc") {
    method.kind = DescriptorKind::kCart;
  } else {
    return absl::InvalidArgumentError(absl::StrCat(
        "unknown method \"", absl::string_view(name.data(), std::min<std::size_t>(name.size(), 40)),
        "\"; use auto, pc, cc, a-pc or a-cc, the last four with -naive, -brute or -naive-brute "
        "behind it for the "
        "slow references"));
  }
  return method;
}

std::string MethodName(const Method& method) {
  if (method.automatic) return "auto";
  return absl::StrCat(method.augmented ? "a-" : "",
                      method.kind == DescriptorKind::kPolar ? "pc" : "cc",
                      method.naive_alignment ? "-naive" : "", method.brute_force ? "-brute" : "");
}

absl::Status CheckServes(const Params& params, const Method& method) {
  if (method.automatic) {
    if (params.structure.enabled) return absl::OkStatus();
    return absl::FailedPreconditionError(
        "the map holds no structures of its scans, so it cannot serve auto; build it with "
        "--keep-scans");
  }
  const bool polar = method.kind == DescriptorKind::kPolar;
  if (polar ? params.polar.enabled : params.cart.enabled) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("the map holds no ", polar ? "polar" : "cart", " contexts, so it cannot serve ",
                   MethodName(method), "; build it with --descriptors ", polar ? "pc" : "cc"));
}

Method DefaultMethod(const Params& params) {
  Method method;
  method.automatic = params.structure.enabled;
  method.kind = params.polar.enabled ? DescriptorKind::kPolar : DescriptorKind::kCart;
  return method;
}

}  // namespace scanloc

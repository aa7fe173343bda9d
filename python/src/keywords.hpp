#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <set>
#include <string>
#include <utility>

#include "scanloc/client/localization_client.hpp"

namespace scanloc::python {

/// Keyword arguments that several calls take alike. Of a wrong type, or unknown: TypeError.
class Keywords {
 public:
  explicit Keywords(nanobind::kwargs given) : given_(std::move(given)) {}

  /// None is as if it were not given.
  template <typename T>
  std::optional<T> Take(const char* name) {
    taken_.insert(name);
    if (!given_.contains(name)) return std::nullopt;
    const nanobind::object value = given_[name];
    if (value.is_none()) return std::nullopt;
    T taken;
    if (!nanobind::try_cast(value, taken)) RefuseType(name, value);
    return taken;
  }

  /// After all that is known was taken.
  void CheckAllTaken() const;

 private:
  [[noreturn]] static void RefuseType(const char* name, nanobind::handle value);

  nanobind::kwargs given_;
  std::set<std::string> taken_;
};

/// How a map is searched; kQueryKeywords in signatures.
[[nodiscard]] Query TakeQuery(Keywords& keywords);
/// Of one scan; and kRequestKeywords.
[[nodiscard]] client::RequestOptions TakeRequest(Keywords& keywords);
/// Of a robot that keeps moving; and kStreamKeywords.
[[nodiscard]] client::StreamOptions TakeStream(Keywords& keywords);

#define SCANLOC_QUERY_KEYWORDS                                            \
  "method: str | None = None, num_candidates: int | None = None, "        \
  "threshold: float | None = None, min_confidence: float | None = None, " \
  "max_answers: int = 1, prior: Prior | None = None"
#define SCANLOC_REQUEST_KEYWORDS         \
  SCANLOC_QUERY_KEYWORDS                 \
  ", mount: SensorMount | None = None, " \
  "stamp_ns: int = 0, frame_id: str = ''"
#define SCANLOC_STREAM_KEYWORDS          \
  SCANLOC_QUERY_KEYWORDS                 \
  ", mount: SensorMount | None = None, " \
  "max_step_m: float = 20.0"

}  // namespace scanloc::python

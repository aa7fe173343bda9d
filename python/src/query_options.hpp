#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <string>

#include "errors.hpp"
#include "scanloc/core/query.hpp"

namespace scanloc::python {

/// What several calls take by keyword alike.
inline Query QueryOf(const std::optional<std::string>& method, std::optional<int> num_candidates,
                     std::optional<double> threshold, std::optional<double> min_confidence,
                     int max_answers) {
  Query query{.num_candidates = num_candidates,
              .threshold = threshold,
              .min_confidence = min_confidence,
              .max_answers = max_answers};
  if (method) query.method = OrThrow(ParseMethod(*method));
  return query;
}

}  // namespace scanloc::python

/// The keywords of QueryOf, in its order.
#define SCANLOC_QUERY_ARGS                                                 \
  nanobind::kw_only(), nanobind::arg("method") = nanobind::none(),         \
                       nanobind::arg("num_candidates") = nanobind::none(), \
                       nanobind::arg("threshold") = nanobind::none(),      \
                       nanobind::arg("min_confidence") = nanobind::none(), \
                       nanobind::arg("max_answers") = 1

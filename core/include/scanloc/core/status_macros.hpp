#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

// For sources only: the names are too short for headers that others include.

/// Ends the function with the status that the expression gives, unless that is OK.
#define RETURN_IF_ERROR(...)                                                                \
  do {                                                                                      \
    if (absl::Status status_or_ok = (__VA_ARGS__); !status_or_ok.ok()) return status_or_ok; \
  } while (false)

/// ASSIGN_OR_RETURN(const Map map, LoadMap(path)); gives a variable, new or not, the value of an
/// absl::StatusOr, or ends the function with its status. A type with a comma in it is written auto.
#define ASSIGN_OR_RETURN(variable, ...) \
  SCANLOC_ASSIGN_OR_RETURN(SCANLOC_JOIN(status_or_, __LINE__), variable, __VA_ARGS__)

#define SCANLOC_ASSIGN_OR_RETURN(status_or, variable, ...)   \
  auto status_or = (__VA_ARGS__);                            \
  if (!status_or.ok()) return std::move(status_or).status(); \
  variable = *std::move(status_or)
#define SCANLOC_JOIN(a, b) SCANLOC_JOIN_EXPANDED(a, b)
#define SCANLOC_JOIN_EXPANDED(a, b) a##b

#pragma once

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace scanloc::cli {

/// The error of a scan that cannot be read, with the option that passes over it.
inline absl::Status WithSkipHint(const absl::Status& error) {
  if (absl::IsCancelled(error)) return error;
  return {error.code(), absl::StrCat(error.message(), "; --skip-bad-scans passes over such scans")};
}

}  // namespace scanloc::cli

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace scanloc::cli {

/// The text as a string of gnuplot's language: nothing in it is read as a command, an escape or
/// markup. Control characters become spaces.
[[nodiscard]] std::string GnuplotQuoted(std::string_view text);

struct GnuplotOutput {
  std::vector<std::string> files;  ///< contents, in the order asked for
  std::string warnings;            ///< what gnuplot told; empty if all is well
};

/// Runs the script by one `gnuplot` of PATH in a temporary folder, which `files` are written to by
/// name. Thread-safe.
///
/// FailedPrecondition: there is no gnuplot. Internal: it failed or left a file out, with its words.
[[nodiscard]] absl::StatusOr<GnuplotOutput> RunGnuplot(const std::string& script,
                                                       const std::vector<std::string>& files);

}  // namespace scanloc::cli

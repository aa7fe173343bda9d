#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "support/paths.hpp"

namespace scanloc::test {

/// The folder of real scans that are not shipped: $SCANLOC_DATA, else shared/data beside the
/// source.
inline std::filesystem::path RealDataRoot() {
  const char* root = std::getenv("SCANLOC_DATA");
  if (root != nullptr && *root != '\0') return root;
  return std::filesystem::path(SourceDir()).parent_path() / "shared" / "data";
}

/// The path of a file or folder of real data, such as "formats/vlp16-ascii.pcd"; empty if absent.
inline std::string RealData(const std::string& relative) {
  const std::filesystem::path path = RealDataRoot() / relative;
  std::error_code ignored;
  return std::filesystem::exists(path, ignored) ? path.string() : std::string();
}

}  // namespace scanloc::test

/// Declares `const std::string name`, the path of real data; skips the test where it is absent.
#define SCANLOC_REAL_DATA_OR_SKIP(name, relative)                                  \
  const std::string name = ::scanloc::test::RealData(relative);                    \
  if ((name).empty())                                                              \
  GTEST_SKIP() << "no real data: " << ::scanloc::test::RealDataRoot() / (relative) \
               << " is absent; set SCANLOC_DATA to it"

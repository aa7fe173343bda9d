#pragma once

#include <string>

namespace scanloc::test {

/// The root of the source tree.
std::string SourceDir();

/// Where the programs of this build are.
std::string BinDir();

}  // namespace scanloc::test

#pragma once

#include <string>

namespace scanloc::test {

/// The root of the source tree.
std::string SourceDir();

/// A bag of tests/data/bags.
std::string BagPath(const std::string& name);

/// Where the programs of this build are.
std::string BinDir();

}  // namespace scanloc::test

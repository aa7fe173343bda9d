#include "support/paths.hpp"

namespace scanloc::test {

std::string SourceDir() { return SCANLOC_SOURCE_DIR; }

std::string BagPath(const std::string& name) { return SourceDir() + "/tests/data/bags/" + name; }

std::string BinDir() { return SCANLOC_BIN_DIR; }

}  // namespace scanloc::test

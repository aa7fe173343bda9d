#include "scanloc/server/build_info.hpp"

namespace scanloc::server {

const char* BuildVersion() { return SCANLOC_VERSION; }

const char* BuildCompiler() {
#ifdef __clang__
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

}  // namespace scanloc::server

#pragma once

namespace scanloc::server {

/// Version of this build, as of CMakeLists.txt.
[[nodiscard]] const char* BuildVersion();

/// What compiled it.
[[nodiscard]] const char* BuildCompiler();

}  // namespace scanloc::server

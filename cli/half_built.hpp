#pragma once

#include <string>

#include "absl/strings/str_cat.h"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {

/// Of a map whose build was stopped: how far it is and what to do about it.
[[nodiscard]] inline std::string HalfBuilt(const mapdb::FileInfo& info) {
  return absl::StrCat("half built: it has ", info.num_places + info.num_empty + info.num_unreadable,
                      " of ", info.num_scans,
                      " scans, and does not know the places of the others; go on with scanloc "
                      "build --resume");
}

}  // namespace scanloc::cli

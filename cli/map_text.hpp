#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <string>

#include "scanloc/core/params.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::cli {

/// What a map file and a server tell of a map alike. Text is of whole lines; that of an empty
/// extent is none, and null.
[[nodiscard]] report::Json ParamsToJson(const Params& params);
[[nodiscard]] std::string ParamsAsText(const Params& params);
[[nodiscard]] report::Json ExtentToJson(const Eigen::AlignedBox3d& extent_m);
[[nodiscard]] std::string ExtentAsText(const Eigen::AlignedBox3d& extent_m);

/// Of a map whose build was stopped: how far it is and what to do about it.
[[nodiscard]] std::string HalfBuilt(const mapdb::FileInfo& info);

}  // namespace scanloc::cli

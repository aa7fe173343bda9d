#include "cli/map_text.hpp"

#include <set>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "scanloc/core/auto_fields.hpp"

namespace scanloc::cli {
namespace {

const char* ShiftModeName(ShiftMode mode) {
  return mode == ShiftMode::kBounded ? "bounded" : "circular";
}

report::Json PointToJson(const Eigen::Vector3d& p) {
  return {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}};
}

struct FieldText {
  std::string operator()(bool field) const { return field ? "yes" : "no"; }
  std::string operator()(int field) const { return absl::StrCat(field); }
  std::string operator()(double field) const { return absl::StrCat(field); }
  std::string operator()(ShiftMode field) const { return ShiftModeName(field); }
  std::string operator()(const std::vector<double>& field) const {
    return field.empty() ? "none" : absl::StrJoin(field, ", ");
  }
};

}  // namespace

report::Json ParamsToJson(const Params& params) {
  report::Json json = report::Json::object();
  VisitFields(params, [&](const char* name, const auto& field) {
    if constexpr (std::is_same_v<std::decay_t<decltype(field)>, ShiftMode>) {
      json[name] = ShiftModeName(field);
    } else {
      json[name] = field;
    }
  });
  return json;
}

/// All parameters but those of auto that are as its scale has them.
std::string ParamsAsText(const Params& params) {
  Params usual = params;
  usual.automatic = AutoParamsAtScale(params.automatic.scale);
  std::set<std::pair<std::string, std::string>> unsaid;
  VisitAutoFields(usual.automatic,
                  [&](const char* name, auto field, auto /*least*/, auto /*most*/) {
                    unsaid.emplace(name, FieldText()(field));
                  });
  unsaid.erase({"auto.scale", FieldText()(params.automatic.scale)});
  std::string text = "parameters (--json: those of auto that its scale sets, too)\n";
  VisitFields(params, [&](const char* name, const auto& field) {
    const std::string value = FieldText()(field);
    if (!unsaid.contains({name, value})) absl::StrAppendFormat(&text, "  %-22s  %s\n", name, value);
  });
  return text;
}

report::Json ExtentToJson(const Eigen::AlignedBox3d& extent_m) {
  if (extent_m.isEmpty()) return nullptr;
  return {{"min_m", PointToJson(extent_m.min())}, {"max_m", PointToJson(extent_m.max())}};
}

std::string ExtentAsText(const Eigen::AlignedBox3d& extent_m) {
  if (extent_m.isEmpty()) return "";
  const Eigen::Vector3d& low = extent_m.min();
  const Eigen::Vector3d& high = extent_m.max();
  return absl::StrFormat("  extent          x %.1f to %.1f m, y %.1f to %.1f m, z %.1f to %.1f m\n",
                         low.x(), high.x(), low.y(), high.y(), low.z(), high.z());
}

std::string HalfBuilt(const mapdb::FileInfo& info) {
  return absl::StrCat("half built: it has ", info.num_places + info.num_empty + info.num_unreadable,
                      " of ", info.num_scans,
                      " scans, and does not know the places of the others; go on with scanloc "
                      "build --resume");
}

}  // namespace scanloc::cli

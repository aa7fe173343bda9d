#include <algorithm>
#include <charconv>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "encoding.hpp"
#include "scanloc/core/auto_fields.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"

// Parameters by name, as the table `params` has them.

namespace scanloc::mapdb {
namespace {

template <typename T>
std::string NumberText(T value) {
  char buffer[32];
  const std::to_chars_result end = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return {buffer, end.ptr};
}

template <typename T>
bool ParseNumber(std::string_view text, T& value) {
  const std::from_chars_result end = std::from_chars(text.data(), text.data() + text.size(), value);
  return end.ec == std::errc() && end.ptr == text.data() + text.size();
}

std::string FieldText(bool value) { return value ? "true" : "false"; }
std::string FieldText(int value) { return NumberText(value); }
std::string FieldText(double value) { return NumberText(value); }
std::string FieldText(ShiftMode value) { return NumberText(static_cast<int>(value)); }
std::string FieldText(const std::vector<double>& values) {
  return absl::StrJoin(values, ",", [](std::string* text, double value) {
    absl::StrAppend(text, NumberText(value));
  });
}

bool ParseField(std::string_view text, bool& value) {
  value = text == "true";
  return value || text == "false";
}
bool ParseField(std::string_view text, int& value) { return ParseNumber(text, value); }
bool ParseField(std::string_view text, double& value) { return ParseNumber(text, value); }
bool ParseField(std::string_view text, ShiftMode& value) {
  int number = 0;
  if (!ParseNumber(text, number) || number < 0 || number > static_cast<int>(ShiftMode::kBounded)) {
    return false;
  }
  value = static_cast<ShiftMode>(number);
  return true;
}
bool ParseField(std::string_view text, std::vector<double>& values) {
  values.clear();
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(','), text.size());
    if (!ParseNumber(text.substr(0, end), values.emplace_back())) return false;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return true;
}

/// The schema version that brought a number of `auto`.
int VersionOf(std::string_view name) {
  constexpr std::pair<std::string_view, int> kLater[] = {{"auto.verify.fine.num_posts", 4},
                                                         {"auto.verify.hopeless_by", 4},
                                                         {"auto.verify.met_m", 4},
                                                         {"auto.verify.met_rad", 4},
                                                         {"auto.shortlist.found_share", 6},
                                                         {"auto.shortlist.max_found", 6},
                                                         {"auto.shortlist.agreement_per_octave", 6},
                                                         {"auto.shortlist.apart_m", 6},
                                                         {"auto.rivals.along_step_m", 6},
                                                         {"auto.rivals.along_m", 6},
                                                         {"auto.evidence.beside", 7},
                                                         {"auto.track.carried_penalty", 7},
                                                         {"auto.track.doubt", 7},
                                                         {"auto.track.doubt_alone", 7},
                                                         {"auto.track.equal_log_odds", 7},
                                                         {"auto.track.far_log_odds", 7},
                                                         {"auto.track.told_log_odds", 7},
                                                         {"auto.track.told_every_m", 7},
                                                         {"auto.track.climb_m", 7},
                                                         {"auto.track.standing_m", 7},
                                                         {"auto.track.fade_m", 7},
                                                         {"auto.evidence.explaining_score", 8},
                                                         {"auto.verify.heights_share", 8},
                                                         {"auto.evidence.inlier_m", 9},
                                                         {"auto.evidence.inliers_share", 9},
                                                         {"auto.evidence.inliers", 9},
                                                         {"auto.evidence.max_inliers", 9},
                                                         {"auto.evidence.least_inliers", 9},
                                                         {"auto.evidence.beyond_inliers", 9},
                                                         {"auto.evidence.cohort", 10},
                                                         {"auto.evidence.cohort_surely", 10},
                                                         {"auto.evidence.cohort_share", 10},
                                                         {"auto.evidence.cohort_size", 10},
                                                         {"auto.evidence.undecided", 10},
                                                         {"auto.evidence.equal_floors", 10},
                                                         {"auto.shortlist.aside_m", 11},
                                                         {"auto.shortlist.num_asides", 11},
                                                         {"auto.shortlist.num_hypotheses", 11},
                                                         {"auto.evidence.max_unseen", 12},
                                                         {"auto.evidence.equal_of_mirror", 13},
                                                         {"auto.evidence.equal_in_cohort", 14},
                                                         {"auto.evidence.num_beside", 14},
                                                         {"auto.evidence.sure_of_little", 15},
                                                         {"auto.evidence.cohort_lead", 16}};
  for (const auto& [later, version] : kLater) {
    if (later == name) return version;
  }
  return 3;
}

}  // namespace

ParamTexts EncodeParams(const Params& params) {
  ParamTexts texts;
  VisitFields(params, [&](std::string_view name, const auto& field) {
    texts.emplace_back(name, FieldText(field));
  });
  std::ranges::sort(texts);
  return texts;
}

absl::StatusOr<Params> DecodeParams(const ParamTexts& texts, int schema_version) {
  std::map<std::string, std::string, std::less<>> text_of(texts.begin(), texts.end());
  if (schema_version < 2) {
    text_of["structure.enabled"] = FieldText(false);
    text_of["search.min_confidence"] = FieldText(SearchParams{}.min_confidence);
  }
  if (schema_version < schema::kHeightsVersion) {
    text_of.try_emplace("auto.verify.heights_share", FieldText(0.0));
  }
  if (schema_version < schema::kInliersVersion) {
    for (const char* name : {"auto.evidence.inliers_share", "auto.evidence.cohort",
                             "auto.evidence.cohort_surely", "auto.evidence.equal_floors"}) {
      text_of.try_emplace(name, FieldText(0.0));
    }
  }
  if (schema_version < schema::kMirrorVersion) {
    text_of.try_emplace("auto.evidence.equal_of_mirror", FieldText(1.0));
  }
  if (schema_version < schema::kBesideVersion) {
    text_of.try_emplace("auto.evidence.equal_in_cohort", FieldText(1.0));
    text_of.try_emplace("auto.evidence.num_beside", FieldText(0));
  }
  if (schema_version < schema::kLeadVersion) {
    text_of.try_emplace("auto.evidence.cohort_lead", FieldText(0.0));
  }
  if (schema_version < schema::kVersion) {
    double scale = AutoParams{}.scale;
    if (const auto text = text_of.find("auto.scale"); text != text_of.end()) {
      ParseField(text->second, scale);
    }
    const AutoParams usual = AutoParamsAtScale(scale);
    VisitAutoFields(usual, [&](const char* name, auto field, auto /*least*/, auto /*most*/) {
      if (schema_version < VersionOf(name)) text_of.try_emplace(name, FieldText(field));
    });
  }
  Params params;
  std::string problem;
  VisitFields(params, [&](std::string_view name, auto& field) {
    const auto text = text_of.find(name);
    if (!problem.empty()) {
      return;
    }
    if (text == text_of.end()) {
      problem = absl::StrCat("parameter ", std::string(name), " is missing");
    } else if (!ParseField(text->second, field)) {
      problem = absl::StrCat("parameter ", text->first, " is '", text->second, "'");
    }
  });
  if (!problem.empty()) return absl::InvalidArgumentError(problem);
  RETURN_IF_ERROR(Validate(params));
  return params;
}

std::string DescribeDifference(const Params& a, const Params& b) {
  const ParamTexts texts_a = EncodeParams(a);
  const ParamTexts texts_b = EncodeParams(b);
  for (std::size_t i = 0; i < texts_a.size(); ++i) {
    if (texts_a[i] != texts_b[i]) {
      return absl::StrCat(texts_a[i].first, " is '", texts_a[i].second, "', not '",
                          texts_b[i].second, "'");
    }
  }
  return "";
}

}  // namespace scanloc::mapdb

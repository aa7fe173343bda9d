#include <algorithm>
#include <cstddef>
#include <numbers>

#include "deviations.hpp"
#include "scanloc/report/csv.hpp"
#include "scanloc/report/result_text.hpp"

namespace scanloc::report {
namespace {

constexpr int kDistanceDecimals = 6;
constexpr int kDecimals = 9;
constexpr std::size_t kNumCandidateFields = 13;  // from place to qw

void AppendCandidate(const Candidate& candidate, std::vector<std::string>* fields) {
  fields->push_back(std::to_string(candidate.place));
  fields->push_back(candidate.session_name);
  fields->push_back(FixedText(candidate.distance, kDistanceDecimals));
  fields->push_back(
      candidate.confidence.has_value() ? FixedText(*candidate.confidence, kDistanceDecimals) : "");
  fields->push_back(FixedText(candidate.yaw_rad * 180.0 / std::numbers::pi, kDecimals));
  fields->push_back(FixedText(candidate.lateral_m, kDecimals));
  AppendPoseFields(candidate.T_map_query, fields);
}

/// What is told of T_map_query beside itself.
void AppendPoseMore(const Candidate* candidate, std::vector<std::string>* fields) {
  fields->push_back(candidate == nullptr ? "" : FixedText(HeadingDeg(*candidate), kDecimals));
  for (int i = 0; i < 6; ++i) {
    const bool is_known = candidate != nullptr && candidate->covariance.has_value();
    fields->push_back(is_known ? FixedText(Deviation(*candidate->covariance, i), kDistanceDecimals)
                               : "");
  }
}

void AppendGeo(const Candidate* candidate, std::vector<std::string>* fields) {
  if (candidate == nullptr || !candidate->geo) {
    fields->insert(fields->end(), 4, "");
    return;
  }
  const GeoPose& geo = *candidate->geo;
  for (const double value :
       {geo.latitude_deg, geo.longitude_deg, geo.altitude_m, geo.heading_deg}) {
    fields->push_back(FixedText(value, kDecimals));
  }
}

void AppendTruth(const QueryResult& result, const Candidate* candidate,
                 std::vector<std::string>* fields) {
  const std::optional<Pose>& truth = result.T_map_true;
  const bool has_error = candidate != nullptr && truth.has_value();
  const TruthError error = has_error ? ErrorOf(*candidate, *truth) : TruthError();
  const Eigen::Vector3d at_m = truth.value_or(Pose::Identity()).translation();
  const auto add = [fields](bool is_known, double value) {
    fields->push_back(is_known ? FixedText(value, kDecimals) : "");
  };
  add(has_error, error.place_m);
  add(has_error, error.pose.plane_m);
  add(has_error, error.pose.heading_deg);
  add(truth.has_value(), at_m.x());
  add(truth.has_value(), at_m.y());
  add(has_error, error.pose.height_m);
  fields->push_back(eval::MissText(MissOf(error.pose)));
}

}  // namespace

std::string ResultsAsCsv(const std::vector<QueryResult>& results, const ResultFormat& format) {
  std::vector<std::string> fields = {"query",      "outcome", "place",     "session", "distance",
                                     "confidence", "yaw_deg", "lateral_m", "x",       "y",
                                     "z",          "qx",      "qy",        "qz",      "qw"};
  if (format.all_candidates) fields.emplace_back("rank");
  if (format.truth) {
    fields.insert(fields.end(), {"true_place_error_m", "error_m", "yaw_error_deg", "true_x",
                                 "true_y", "height_error_m", "missed"});
  }
  if (format.sequence) fields.insert(fields.end(), {"num_scans", "relocated"});
  fields.emplace_back("heading_deg");
  fields.insert(fields.end(), kDeviationNames.begin(), kDeviationNames.end());
  if (format.several_maps) fields.emplace_back("map");
  if (format.geo) {
    fields.insert(fields.end(), {"latitude", "longitude", "altitude", "true_heading_deg"});
  }
  std::string csv = CsvRow(fields);
  for (const QueryResult& result : results) {
    const std::vector<Candidate>& candidates = result.answer.candidates;
    // A query without a candidate has a row, too.
    const std::size_t num_rows =
        format.all_candidates ? std::max<std::size_t>(1, candidates.size()) : 1;
    for (std::size_t i = 0; i < num_rows; ++i) {
      const Candidate* candidate = i < candidates.size() ? &candidates[i] : nullptr;
      fields = {result.query, OutcomeName(result.answer.outcome)};
      if (candidate != nullptr) {
        AppendCandidate(*candidate, &fields);
      } else {
        fields.insert(fields.end(), kNumCandidateFields, "");
      }
      if (format.all_candidates) {
        fields.push_back(candidate != nullptr ? std::to_string(i + 1) : "");
      }
      if (format.truth) AppendTruth(result, candidate, &fields);
      if (format.sequence) {
        fields.push_back(std::to_string(result.num_scans));
        fields.emplace_back(result.is_relocated ? "1" : "0");
      }
      AppendPoseMore(candidate, &fields);
      if (format.several_maps) fields.push_back(candidate != nullptr ? candidate->map : "");
      if (format.geo) AppendGeo(candidate, &fields);
      csv += CsvRow(fields);
    }
  }
  return csv;
}

}  // namespace scanloc::report

#include <cstddef>
#include <optional>

#include "deviations.hpp"
#include "outcome_json.hpp"
#include "scanloc/report/json.hpp"
#include "scanloc/report/result_text.hpp"

namespace scanloc::report {
namespace {

Json Optional(const std::optional<double>& value) {
  return value.has_value() ? Json(*value) : Json(nullptr);
}

Json PriorToJson(const Prior& prior) {
  if (prior.is_open()) return nullptr;
  Json json{{"disc", nullptr}, {"heights", nullptr}, {"sessions", prior.sessions}};
  if (prior.disc) {
    json["disc"] = {
        {"x", prior.disc->x_m}, {"y", prior.disc->y_m}, {"radius_m", prior.disc->radius_m}};
  }
  if (prior.on_earth) {
    json["on_earth"] = {{"latitude", prior.on_earth->latitude_deg},
                        {"longitude", prior.on_earth->longitude_deg},
                        {"radius_m", prior.on_earth->radius_m}};
  }
  if (prior.heights) json["heights"] = {prior.heights->min_m, prior.heights->max_m};
  return json;
}

Json CandidateToJson(const Candidate& candidate, const std::optional<Pose>& T_map_true) {
  Json json;
  json["place"] = candidate.place;
  json["session"] = candidate.session_name;
  if (!candidate.map.empty()) json["map"] = candidate.map;
  json["distance"] = candidate.distance;
  json["confidence"] = Optional(candidate.confidence);
  json["yaw_deg"] = candidate.yaw_rad * kDegPerRad;
  json["lateral_m"] = candidate.lateral_m;
  json["T_map_place"] = PoseToJson(candidate.T_map_place);
  json["T_map_query"] = PoseToJson(candidate.T_map_query);
  json["heading_deg"] = HeadingDeg(candidate);
  if (candidate.geo) json["geo"] = GeoToJson(*candidate.geo);
  json["covariance"] = nullptr;
  if (candidate.covariance) {
    for (int i = 0; i < 6; ++i) {
      json[kDeviationNames[static_cast<std::size_t>(i)]] = Deviation(*candidate.covariance, i);
    }
    json["covariance"] = Json::array();
    for (const double element : candidate.covariance->reshaped()) {
      json["covariance"].push_back(element);
    }
  }
  if (T_map_true.has_value()) {
    const TruthError error = ErrorOf(candidate, *T_map_true);
    json["true_place_error_m"] = error.place_m;
    json["error_m"] = error.pose.plane_m;
    json["height_error_m"] = error.pose.height_m;
    json["yaw_error_deg"] = error.pose.heading_deg;
    json["missed"] = eval::MissText(MissOf(error.pose));
  }
  return json;
}

Json SummaryToJson(const Summary& summary, bool truth) {
  Json json;
  AddOutcomes(summary.all, &json);
  json["num_insufficient_scan"] = summary.all.num_insufficient;  // the name it had
  if (!truth) return json;
  const auto recall = [&](std::size_t num_right) {
    const std::size_t num = summary.with_truth.num_queries;
    return num == 0 ? Json(nullptr)
                    : Json(static_cast<double>(num_right) / static_cast<double>(num));
  };
  json["num_with_truth"] = summary.with_truth.num_queries;
  AddRightAndFalse(summary.with_truth, &json);
  json["within_m"] = summary.within_m;
  json["recall_at_1"] = recall(summary.num_top1_right);
  json["recall_at_k"] = recall(summary.num_topk_right);
  json["num_localized_wrong"] = summary.with_truth.num_false;  // the name it had
  json["median_true_place_error_m"] = Optional(summary.median_place_m);
  json["median_error_m"] = Optional(summary.median_pose_m);
  json["median_yaw_error_deg"] = Optional(summary.median_yaw_deg);
  return json;
}

}  // namespace

Json PoseToJson(const Pose& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  const Eigen::Vector3d& t = pose.translation();
  return {{"x", t.x()},  {"y", t.y()},  {"z", t.z()}, {"qx", q.x()},
          {"qy", q.y()}, {"qz", q.z()}, {"qw", q.w()}};
}

Json GeoToJson(const GeoPose& geo) {
  return {{"latitude", geo.latitude_deg},
          {"longitude", geo.longitude_deg},
          {"altitude_m", geo.altitude_m},
          {"heading_deg", geo.heading_deg}};
}

Json GeoToJson(const GeoOrigin& origin) {
  return {{"latitude", origin.latitude_deg},
          {"longitude", origin.longitude_deg},
          {"altitude_m", origin.altitude_m},
          {"heading_deg", origin.heading_deg},
          {"anchor_m", {origin.anchor_m.x(), origin.anchor_m.y(), origin.anchor_m.z()}}};
}

Json AnswerToJson(const Answer& answer, const std::optional<Pose>& T_map_true) {
  Json json{{"outcome", OutcomeName(answer.outcome)},
            {"reason", answer.reason},
            {"candidates", Json::array()}};
  for (const Candidate& candidate : answer.candidates) {
    json["candidates"].push_back(CandidateToJson(candidate, T_map_true));
  }
  return json;
}

std::string ResultsAsJson(const std::vector<QueryResult>& results, const std::string& method,
                          const ResultFormat& format) {
  Json json;
  json["content_id"] = results.empty() ? Json(nullptr) : Json(results.front().answer.content_id);
  json["method"] = method;
  json["mount"] = MountToJson(format.mount);
  json["prior"] = PriorToJson(format.prior);
  json["queries"] = Json::array();
  for (const QueryResult& result : results) {
    Json query{{"query", result.query}};
    Json answer = AnswerToJson(result.answer, result.T_map_true);
    query["outcome"] = answer["outcome"];
    query["reason"] = answer["reason"];
    if (format.sequence) {
      query["num_scans"] = result.num_scans;
      query["relocated"] = result.is_relocated;
    }
    query["candidates"] = std::move(answer["candidates"]);
    if (result.T_map_true.has_value()) query["T_map_true"] = PoseToJson(*result.T_map_true);
    json["queries"].push_back(std::move(query));
  }
  json["summary"] = SummaryToJson(Summarize(results, format.within_m), format.truth);
  return ToText(json);
}

}  // namespace scanloc::report

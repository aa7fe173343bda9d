#include <algorithm>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "deviations.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/eval/quantile.hpp"
#include "scanloc/report/csv.hpp"
#include "scanloc/report/result_text.hpp"

namespace scanloc::report {
namespace {

using Row = std::vector<std::string>;

// The first two columns are text and lean left, the others are numbers and lean right.
std::string Align(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string padding(widths[i] - row[i].size(), ' ');
      if (i > 0) text += "  ";
      text += i < 2 ? row[i] + padding : padding + row[i];
    }
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  return text;
}

Row RowOf(const QueryResult& result, const Candidate* candidate, const ResultFormat& format) {
  Row row = {Printable(result.query), OutcomeName(result.answer.outcome)};
  const bool truth = format.truth;
  if (format.sequence) row.push_back(std::to_string(result.num_scans));
  if (format.several_maps) row.push_back(candidate == nullptr ? "-" : Printable(candidate->map));
  if (candidate == nullptr) {
    row.insert(row.end(), (truth ? 15U : 10U) + (format.geo ? 3U : 0U), "-");
    return row;
  }
  const Eigen::Vector3d& position = candidate->T_map_query.translation();
  row.push_back(std::to_string(candidate->place));
  row.push_back(Printable(candidate->session_name));
  row.push_back(FixedText(candidate->distance, 3));
  row.push_back(candidate->confidence ? FixedText(*candidate->confidence, 3) : "-");
  row.push_back(FixedText(candidate->yaw_rad * 180.0 / std::numbers::pi, 1));
  row.push_back(FixedText(candidate->lateral_m, 1));
  row.push_back(FixedText(position.x(), 2));
  row.push_back(FixedText(position.y(), 2));
  row.push_back(FixedText(position.z(), 2));
  row.push_back(FixedText(HeadingDeg(*candidate), 1));
  if (format.geo) {
    const auto& geo = candidate->geo;
    row.push_back(geo ? FixedText(geo->latitude_deg, 7) : "-");
    row.push_back(geo ? FixedText(geo->longitude_deg, 7) : "-");
    row.push_back(geo ? FixedText(geo->heading_deg, 1) : "-");
  }
  if (!truth) return row;
  if (!result.T_map_true.has_value()) {
    row.insert(row.end(), 5, "-");
    return row;
  }
  const TruthError error = ErrorOf(*candidate, *result.T_map_true);
  row.push_back(FixedText(error.place_m, 1));
  row.push_back(FixedText(error.pose.plane_m, 1));
  row.push_back(FixedText(error.pose.height_m, 1));
  row.push_back(FixedText(error.pose.heading_deg, 1));
  const std::string missed = eval::MissText(MissOf(error.pose));
  row.push_back(missed.empty() ? "-" : missed);
  return row;
}

std::string Percent(std::size_t part, std::size_t whole) {
  return absl::StrFormat(
      "%d of %d (%.1f %%)", part, whole,
      whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

std::string TimesText(const std::vector<QueryResult>& results) {
  const auto median_ms = [&](auto&& time_ns) {
    std::vector<double> times_ms;
    times_ms.reserve(results.size());
    for (const QueryResult& result : results) {
      times_ms.push_back(static_cast<double>(time_ns(result)) / 1e6);
    }
    return eval::Quantile(std::move(times_ms), 0.5).value_or(0.0);
  };
  return absl::StrFormat(
      "  time a query      %.2f ms, median; reading its file took %.2f ms more\n"
      "    of which        describe %.2f ms, retrieve %.2f ms, match %.2f ms, verify "
      "%.2f ms\n",
      median_ms([](const QueryResult& r) { return r.ask_ns; }),
      median_ms([](const QueryResult& r) { return r.read_ns; }),
      median_ms([](const QueryResult& r) { return r.answer.times.describe_ns; }),
      median_ms([](const QueryResult& r) { return r.answer.times.retrieve_ns; }),
      median_ms([](const QueryResult& r) { return r.answer.times.match_ns; }),
      median_ms([](const QueryResult& r) { return r.answer.times.verify_ns; }));
}

std::string TruthText(const Summary& summary, bool all_candidates) {
  std::string text = absl::StrFormat(
      "  recall@1          %s have a place within %g m as best candidate\n",
      Percent(summary.num_top1_right, summary.with_truth.num_queries), summary.within_m);
  if (all_candidates) {
    absl::StrAppendFormat(&text, "  recall@k          %s have one among their candidates\n",
                          Percent(summary.num_topk_right, summary.with_truth.num_queries));
  }
  const eval::OutcomeCounts& counts = summary.with_truth;
  const PoseLimits limits;
  absl::StrAppendFormat(&text,
                        "  right             %s localized within %g m, %g m of height and %g deg\n",
                        Percent(counts.num_localized_right, counts.num_queries), limits.plane_m,
                        limits.height_m, limits.heading_deg);
  absl::StrAppendFormat(&text, "  localized wrong   %s",
                        Percent(counts.num_false, counts.num_localized));
  if (counts.num_false > 0) {
    absl::StrAppendFormat(&text, ": %d missed in the plane, %d in height, %d in heading",
                          counts.num_false_plane, counts.num_false_height,
                          counts.num_false_heading);
  }
  text += '\n';
  if (summary.median_pose_m.has_value()) {
    absl::StrAppendFormat(
        &text,
        "  median errors     place %.2f m, position %.2f m, yaw %.2f deg; of those recalled\n",
        *summary.median_place_m, *summary.median_pose_m, *summary.median_yaw_deg);
  }
  return text;
}

}  // namespace

std::string ResultsAsTable(const std::vector<QueryResult>& results, const ResultFormat& format) {
  std::vector<Row> rows = {{"query", "outcome", "place", "session", "distance", "confidence",
                            "yaw_deg", "lateral_m", "x", "y", "z", "heading_deg"}};
  if (format.several_maps) rows.front().insert(rows.front().begin() + 2, "map");
  if (format.sequence) rows.front().insert(rows.front().begin() + 2, "num_scans");
  if (format.geo) {
    rows.front().insert(rows.front().end(), {"latitude", "longitude", "true_heading_deg"});
  }
  if (format.truth) {
    rows.front().insert(rows.front().end(), {"true_place_error_m", "error_m", "height_error_m",
                                             "yaw_error_deg", "missed"});
  }
  for (const QueryResult& result : results) {
    const std::vector<Candidate>& candidates = result.answer.candidates;
    if (candidates.empty()) rows.push_back(RowOf(result, nullptr, format));
    for (const Candidate& candidate : candidates) {
      rows.push_back(RowOf(result, &candidate, format));
      if (!format.all_candidates) break;
    }
  }
  return Align(rows);
}

std::string SummaryText(const std::vector<QueryResult>& results, const ResultFormat& format) {
  const Summary summary = Summarize(results, format.within_m);
  const eval::OutcomeCounts& all = summary.all;
  std::string text = absl::StrFormat(
      "%d %s\n"
      "  localized         %s\n"
      "  otherwise         %d ambiguous, %d not recognised, %d scans with too few points\n",
      all.num_queries, all.num_queries == 1 ? "query" : "queries",
      Percent(all.num_localized, all.num_queries), all.num_ambiguous, all.num_not_recognized,
      all.num_insufficient);
  if (format.truth) {
    if (summary.with_truth.num_queries < all.num_queries) {
      absl::StrAppend(&text, "  true pose known   ",
                      Percent(summary.with_truth.num_queries, all.num_queries), "\n");
    }
    absl::StrAppend(&text, TruthText(summary, format.all_candidates));
  }
  return text + TimesText(results);
}

}  // namespace scanloc::report

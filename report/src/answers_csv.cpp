#include "scanloc/report/answers_csv.hpp"

#include <cmath>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/report/csv.hpp"

namespace scanloc::report {
namespace {

/// More than the answers of any one drive.
constexpr std::int64_t kMaxCsvBytes = 1LL << 30;

absl::StatusOr<std::optional<Eigen::Vector2d>> ReadPoint(const CsvTable& table, std::size_t row,
                                                         const char* x_column,
                                                         const char* y_column) {
  ASSIGN_OR_RETURN(const std::optional<double> x, table.Number(row, x_column));
  ASSIGN_OR_RETURN(const std::optional<double> y, table.Number(row, y_column));
  if (!x.has_value() || !y.has_value()) return std::nullopt;
  return Eigen::Vector2d(*x, *y);
}

absl::StatusOr<CsvAnswer> ReadAnswer(const CsvTable& table, std::size_t row) {
  CsvAnswer answer{.query = table.Text(row, "query"), .outcome = table.Text(row, "outcome")};
  ASSIGN_OR_RETURN(const std::optional<double> place, table.Number(row, "place"));
  if (place.has_value()) {
    constexpr double kMaxPlace = 1e15;
    if (*place < 0.0 || *place > kMaxPlace || std::floor(*place) != *place) {
      return absl::InvalidArgumentError(absl::StrCat(answer.query, ": place is \"",
                                                     table.Text(row, "place").substr(0, 40),
                                                     "\", which is no index"));
    }
    answer.place = static_cast<std::size_t>(*place);
  }
  absl::StatusOr<std::optional<Eigen::Vector2d>> point = ReadPoint(table, row, "x", "y");
  if (!point.ok()) return point.status();
  answer.answered = *point;
  if (table.HasColumn("true_x") && table.HasColumn("true_y")) {
    point = ReadPoint(table, row, "true_x", "true_y");
    if (!point.ok()) return point.status();
    answer.truth = *point;
  }
  if (answer.truth && answer.answered && table.HasColumn("missed")) {
    answer.is_right = table.Text(row, "missed").empty();
  }
  return answer;
}

absl::StatusOr<std::vector<CsvAnswer>> ReadAnswers(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadFile(path, kMaxCsvBytes));
  ASSIGN_OR_RETURN(const CsvTable table, CsvTable::Parse(text));
  for (const char* column : {"query", "outcome", "place", "x", "y"}) {
    if (!table.HasColumn(column)) {
      return absl::InvalidArgumentError(absl::StrCat("it has no column \"", column,
                                                     "\", so it is not the CSV of scanloc locate"));
    }
  }
  std::vector<CsvAnswer> answers;
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    if (table.HasColumn("rank")) {
      const std::string& rank = table.Text(row, "rank");
      if (!rank.empty() && rank != "1") continue;
    }
    ASSIGN_OR_RETURN(CsvAnswer answer, ReadAnswer(table, row));
    answers.push_back(std::move(answer));
  }
  return answers;
}

}  // namespace

absl::StatusOr<std::vector<CsvAnswer>> ReadAnswersCsv(const std::string& path) {
  absl::StatusOr<std::vector<CsvAnswer>> answers = ReadAnswers(path);
  if (answers.ok()) return answers;
  return absl::Status(answers.status().code(),
                      absl::StrCat(path, ": ", answers.status().message()));
}

}  // namespace scanloc::report

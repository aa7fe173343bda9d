#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/report/csv.hpp"

namespace scanloc::cli {
namespace {

/// What a report says of one query by one method.
struct Judged {
  std::string outcome;
  bool is_false = false;  ///< localized, and the pose is wrong
  bool is_found = false;  ///< localized, and the pose is right
};

/// From bad to good.
int RankOf(const Judged& judged) { return judged.is_found ? 2 : judged.is_false ? 0 : 1; }

using Report = std::map<std::string, std::map<std::string, Judged>>;  // by method, then query

absl::StatusOr<Report> ReadReport(const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "matches.csv").string();
  constexpr std::int64_t kMostBytes = 1LL << 30;
  const absl::StatusOr<std::string> text = ReadFile(path, kMostBytes);
  if (!text.ok()) {
    return absl::NotFoundError(
        absl::StrCat(text.status().message(), "; give the folder of scanloc eval --report"));
  }
  const auto table = report::CsvTable::Parse(*text);
  if (!table.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", table.status().message()));
  }
  for (const char* column : {"query", "method", "outcome", "is_pose_right"}) {
    if (table->HasColumn(column)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(path, " has no column ", column, "; it is no report of this version"));
  }
  Report report;
  for (std::size_t row = 0; row < table->num_rows(); ++row) {
    const std::string& outcome = table->Text(row, "outcome");
    const bool is_localized = outcome == "localized";
    const bool is_right = table->Text(row, "is_pose_right") == "1";
    report[table->Text(row, "method")][table->Text(row, "query")] = {
        outcome, is_localized && !is_right, is_localized && is_right};
  }
  return report;
}

struct Counts {
  int num_queries = 0;
  int num_found[2] = {0, 0};
  int num_false[2] = {0, 0};
  std::string better, worse;
};

Counts Compare(const std::string& method, const std::map<std::string, Judged>& before,
               const std::map<std::string, Judged>& after) {
  const auto text = [](const Judged& judged) {
    return judged.is_found   ? std::string("found")
           : judged.is_false ? std::string("FALSE")
                             : judged.outcome;
  };
  Counts counts;
  for (const auto& [query, was] : before) {
    const auto found = after.find(query);
    if (found == after.end()) continue;
    const Judged& is = found->second;
    ++counts.num_queries;
    counts.num_found[0] += was.is_found ? 1 : 0;
    counts.num_found[1] += is.is_found ? 1 : 0;
    counts.num_false[0] += was.is_false ? 1 : 0;
    counts.num_false[1] += is.is_false ? 1 : 0;
    if (RankOf(was) == RankOf(is)) continue;
    absl::StrAppend(RankOf(is) > RankOf(was) ? &counts.better : &counts.worse, "  ",
                    Printable(query), "  ", Printable(method), "  ", text(was), " -> ", text(is),
                    "\n");
  }
  return counts;
}

class ReportDiffCommand : public Command {
 public:
  ReportDiffCommand()
      : Command("report-diff", "Say what is better and worse in one evaluation than in another") {}
  void Declare(CLI::App& app) override {
    app.add_option("A", before_, "Folder of scanloc eval --report, before")->required();
    app.add_option("B", after_, "The same, after")->required();
    app.footer(
        "Found: localized with a right pose. FALSE: localized with a wrong one.\n"
        "Queries are paired by name; those that one report alone has are counted.\n"
        "Examples:\n"
        "  scanloc report-diff report-before report-after");
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const auto before, ReadReport(before_));
    ASSIGN_OR_RETURN(const auto after, ReadReport(after_));
    std::string text =
        absl::StrFormat("%-14s %8s %15s %15s\n", "method", "queries", "found", "false");
    std::string better, worse;
    bool has_any = false;
    for (const auto& [method, queries] : before) {
      const auto found = after.find(method);
      if (found == after.end()) continue;
      has_any = true;
      const Counts counts = Compare(method, queries, found->second);
      absl::StrAppendFormat(&text, "%-14s %8d %6d -> %5d %6d -> %5d\n", Printable(method),
                            counts.num_queries, counts.num_found[0], counts.num_found[1],
                            counts.num_false[0], counts.num_false[1]);
      const auto num_alone = queries.size() + found->second.size() - 2U * counts.num_queries;
      if (num_alone > 0) absl::StrAppend(&text, "  ", num_alone, " queries are in one only\n");
      better += counts.better;
      worse += counts.worse;
    }
    if (!has_any) return absl::InvalidArgumentError("the two reports have no method in common");
    absl::StrAppend(&text, "better:\n", better.empty() ? "  none\n" : better, "worse:\n",
                    worse.empty() ? "  none\n" : worse);
    return WriteText("-", text);
  }

 private:
  std::string before_;
  std::string after_;
};

}  // namespace

std::unique_ptr<Command> MakeReportDiffCommand() { return std::make_unique<ReportDiffCommand>(); }

}  // namespace scanloc::cli

#include "cli/descriptor_options.hpp"

#include <filesystem>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/matrix_file.hpp"
#include "scanloc/eval/vector_baseline.hpp"

namespace scanloc::cli {
namespace {

/// Which row of a file is each scan's.
struct Rows {
  std::vector<std::size_t> row_of;
  std::size_t num_rows = 0;  ///< that the file should have
};

absl::StatusOr<Rows> RowsOf(const std::vector<std::string>& folders,
                            const std::vector<dataset::ScanFile>& scans) {
  std::map<std::string, std::size_t> row_of_path;
  Rows rows;
  for (const std::string& folder : folders) {
    ASSIGN_OR_RETURN(const std::vector<dataset::ScanFile> listed, dataset::ListScans(folder));
    for (const dataset::ScanFile& scan : listed) row_of_path.emplace(scan.path, rows.num_rows++);
  }
  for (const dataset::ScanFile& scan : scans) {
    const auto found = row_of_path.find(scan.path);
    if (found == row_of_path.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat(scan.path, " is none of the scans that have a row of descriptors"));
    }
    rows.row_of.push_back(found->second);
  }
  return rows;
}

absl::StatusOr<std::vector<Eigen::VectorXf>> ReadRows(const std::string& file, const Rows& rows,
                                                      const std::string& needed) {
  ASSIGN_OR_RETURN(const dataset::RowMatrix matrix, dataset::ReadMatrix(file));
  if (static_cast<std::size_t>(matrix.rows()) != rows.num_rows) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, " has ", matrix.rows(), " rows; ", needed));
  }
  std::vector<Eigen::VectorXf> vectors;
  vectors.reserve(rows.row_of.size());
  for (const std::size_t row : rows.row_of) {
    vectors.emplace_back(matrix.row(static_cast<Eigen::Index>(row)).transpose());
  }
  return vectors;
}

/// A row a place, or a row a scan of these folders.
absl::StatusOr<std::vector<Eigen::VectorXf>> ReadPlaceRows(const std::string& file,
                                                           const std::vector<std::string>& folders,
                                                           const DescriptorOptions::Scans& scans) {
  Rows by_place{.row_of = {}, .num_rows = scans.num_places};
  for (std::size_t i = 0; i < scans.num_places; ++i) by_place.row_of.push_back(i);
  std::string needed = absl::StrCat(scans.num_places, " are needed, one a place of the map");
  if (scans.places.empty()) {
    return ReadRows(file, by_place,
                    absl::StrCat(needed, "; with --map-scans also one a scan of that folder"));
  }
  ASSIGN_OR_RETURN(const Rows by_scan, RowsOf(folders, scans.places));
  absl::StrAppend(&needed, ", or ", by_scan.num_rows, ", one a scan that it was made of");
  absl::StatusOr<std::vector<Eigen::VectorXf>> vectors = ReadRows(file, by_scan, needed);
  if (vectors.ok() || by_scan.num_rows == scans.num_places) return vectors;
  return ReadRows(file, by_place, needed);
}

}  // namespace

void DescriptorOptions::Declare(CLI::App& app) {
  app.add_option("--descriptors-from", of_queries_,
                 "NumPy array (.npy) of descriptors computed elsewhere, to judge as a method named "
                 "as the file: one row a scan of --scans, by name, then one a scan of each of "
                 "--negatives; may be given several times")
      ->type_name("FILE");
  app.add_option("--map-descriptors-from", of_places_,
                 "The same for the map, one for each of these: one row a place, or a scan of "
                 "--map-scans [--in-session: the same file]")
      ->type_name("FILE");
  app.add_option("--descriptor-distance", distance_, "How their rows are compared")
      ->check(CLI::IsMember({"l2", "cosine"}));
}

absl::Status DescriptorOptions::CheckUsage(bool has_bag, bool in_session, double tilt_deg) const {
  const bool is_own_map = in_session && of_places_.empty();
  if (of_places_.size() != of_queries_.size() && !is_own_map) {
    return absl::InvalidArgumentError(
        absl::StrCat("each --descriptors-from needs a --map-descriptors-from; there are ",
                     of_queries_.size(), " and ", of_places_.size()));
  }
  if (empty()) return absl::OkStatus();
  if (has_bag) {
    return absl::InvalidArgumentError(
        "--descriptors-from has a row a file of --scans; it does not go with --bag");
  }
  if (tilt_deg > 0.0) {
    return absl::InvalidArgumentError(
        "--query-tilt-deg turns the scans, of which descriptors computed elsewhere know nothing; "
        "leave out --descriptors-from");
  }
  return absl::OkStatus();
}

absl::Status DescriptorOptions::AddTo(const Scans& scans, eval::EvalOptions* options) const {
  if (empty()) return absl::OkStatus();
  std::vector<std::string> query_folders = {scans.scans_dir};
  query_folders.insert(query_folders.end(), scans.negatives.begin(), scans.negatives.end());
  // Within a session the places are scans of the queries' own folder.
  const std::vector<std::string> place_folders =
      of_places_.empty()
          ? query_folders
          : std::vector{scans.map_scans_dir.empty() ? scans.scans_dir : scans.map_scans_dir};
  ASSIGN_OR_RETURN(const Rows query_rows, RowsOf(query_folders, scans.queries));
  for (std::size_t i = 0; i < of_queries_.size(); ++i) {
    const std::string& file = of_queries_[i];
    const std::string name = Printable(std::filesystem::path(file).stem().string());
    for (const eval::EvalMethod& other : options->methods) {
      if (other.name != name) continue;
      return absl::InvalidArgumentError(
          absl::StrCat(file, ": a method is named \"", name, "\" already; rename the file"));
    }
    ASSIGN_OR_RETURN(std::vector<Eigen::VectorXf> of_queries,
                     ReadRows(file, query_rows,
                              absl::StrCat(query_rows.num_rows,
                                           " are needed, one a scan of --scans and --negatives")));
    const std::string& map_file = of_places_.empty() ? file : of_places_[i];
    ASSIGN_OR_RETURN(std::vector<Eigen::VectorXf> of_places,
                     ReadPlaceRows(map_file, place_folders, scans));
    if (!of_places.empty() && of_places.front().size() != of_queries.front().size()) {
      return absl::InvalidArgumentError(
          absl::StrCat(file, " has ", of_queries.front().size(), " columns and ", map_file, " ",
                       of_places.front().size(), "; descriptors are of one length"));
    }
    options->baselines.push_back(std::make_shared<eval::ComputedDescriptors>(
        name, distance_ == "cosine" ? eval::VectorDistance::kCosine : eval::VectorDistance::kL2,
        std::move(of_queries), std::move(of_places)));
    options->methods.push_back(
        {.name = name, .method = {}, .num_candidates = {}, .is_baseline = true, .baseline = name});
  }
  return absl::OkStatus();
}

}  // namespace scanloc::cli

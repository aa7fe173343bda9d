#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/eval/baseline.hpp"
#include "scanloc/eval/evaluation.hpp"

namespace scanloc::cli {

/// Descriptors of scans that were computed elsewhere, as options of the command line.
class DescriptorOptions {
 public:
  /// Declares --descriptors-from, --map-descriptors-from and --descriptor-distance.
  void Declare(CLI::App& app);
  [[nodiscard]] bool empty() const { return of_queries_.empty(); }

  /// What the options need of others: scans in folders, as they are, and rows for the map.
  [[nodiscard]] absl::Status CheckUsage(bool has_bag, bool in_session, double tilt_deg) const;

  /// Where the scans of an evaluation lie.
  struct Scans {
    const std::string& scans_dir;
    const std::vector<std::string>& negatives;  ///< folders
    const std::vector<dataset::ScanFile>& queries;
    const std::string& map_scans_dir;              ///< empty: not told
    const std::vector<dataset::ScanFile>& places;  ///< empty: not known
    std::size_t num_places = 0;
  };
  /// Appends a baseline and a method a file. InvalidArgument, with the file: not a matrix as it
  /// should be, the wrong number of rows, rows of two lengths, or a name that is taken.
  [[nodiscard]] absl::Status AddTo(const Scans& scans, eval::EvalOptions* options) const;

 private:
  std::vector<std::string> of_queries_;
  std::vector<std::string> of_places_;
  std::string distance_ = "l2";
};

}  // namespace scanloc::cli

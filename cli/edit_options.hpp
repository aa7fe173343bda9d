#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/mapdb/edit_map.hpp"

namespace scanloc::cli {

/// Edits of a map as options of the command line, in the order given.
class EditOptions {
 public:
  /// Those that need no more than the map.
  void Declare(CLI::App& app);

  /// OK, or InvalidArgument: there is no edit.
  [[nodiscard]] absl::Status CheckUsage() const;

  /// In the order of the command line.
  struct Given {
    std::string text;  ///< as it was given
    mapdb::Edit edit;
  };
  [[nodiscard]] std::vector<Given> Take() const;

 private:
  struct Kind {
    CLI::Option* option = nullptr;
    /// InvalidArgument: the text is none of this kind.
    absl::StatusOr<mapdb::Edit> (*parse)(const std::string& text) = nullptr;
  };
  void Add(CLI::App& app, const char* flag,
           absl::StatusOr<mapdb::Edit> (*parse)(const std::string&), const char* type,
           const char* what);

  const CLI::App* app_ = nullptr;
  std::vector<Kind> kinds_;
};

}  // namespace scanloc::cli

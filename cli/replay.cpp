#include "cli/replay.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc::cli {
namespace {

namespace fs = std::filesystem;

/// A request and its answer.
constexpr std::int64_t kMaxFileBytes = 2LL * limits::kMaxMessageBytes;

}  // namespace

absl::StatusOr<std::vector<std::string>> ListCapturedQueries(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return std::vector<std::string>{path};
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    if (entry.path().extension() == ".query") files.push_back(entry.path().string());
  }
  if (error) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot list folder ", path, ": ", error.message()));
  }
  if (files.empty()) {
    return absl::NotFoundError(absl::StrCat("folder ", path, " holds no captured query (*.query)"));
  }
  std::ranges::sort(files);
  return files;
}

absl::StatusOr<ReplayedQuery> ReadCapturedQuery(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path, kMaxFileBytes));
  auto query = proto::ParseCapturedQuery(bytes);
  if (!query.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("file ", path, ": ", query.status().message()));
  }
  return ReplayedQuery{.name = fs::path(path).filename().string(), .query = *std::move(query)};
}

}  // namespace scanloc::cli

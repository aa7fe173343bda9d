#pragma once

#include <chrono>
#include <map>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "scanloc/catalogue/catalogue.hpp"

namespace scanloc::server {

/// What became of versions that were to be fetched, and what is said of them meanwhile.
class FetchFailures {
 public:
  /// Robots come back after so long for a map that is being fetched, or cannot be.
  static constexpr std::chrono::seconds kRetryFetched{1};
  static constexpr std::chrono::seconds kRetryFailed{30};

  /// Of a failure that may pass by itself no more is kept than that there is no room.
  void Note(const catalogue::Version& version, const absl::Status& status);
  void Clear() { *this = {}; }

  /// Unavailable: the version is being fetched, or what stands in the way.
  [[nodiscard]] absl::Status WhyNotServed(const catalogue::Version& version) const;

 private:
  std::map<std::string, std::string> lasting_;  // by file
  std::set<std::string> without_room_;          // files
};

}  // namespace scanloc::server

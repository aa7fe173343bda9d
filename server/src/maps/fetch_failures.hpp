#pragma once

#include <chrono>
#include <map>
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

  /// Of a failure that may pass by itself nothing is kept.
  void Note(const catalogue::Version& version, const absl::Status& status);
  void Clear() { lasting_.clear(); }

  /// Unavailable: the version is being fetched, or what stands in the way for long.
  [[nodiscard]] absl::Status WhyNotServed(const catalogue::Version& version) const;

 private:
  std::map<std::string, std::string> lasting_;  // by file
};

}  // namespace scanloc::server

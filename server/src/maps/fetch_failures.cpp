#include "maps/fetch_failures.hpp"

#include "absl/strings/str_cat.h"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Nothing of paths or addresses: whoever asks is told.
std::string LastingHindrance(const absl::Status& failure) {
  if (absl::IsFailedPrecondition(failure)) return "it is too large for this server, or too new";
  if (absl::IsNotFound(failure)) return "the store does not have it";
  if (absl::IsDataLoss(failure)) return "what the store has is not what was published";
  return "";
}

absl::Status Unavailable(v1::ErrorReason reason, const std::string& text,
                         std::chrono::seconds retry) {
  return proto::WithRetryAfter(proto::WithReason(reason, absl::UnavailableError(text)),
                               static_cast<double>(retry.count()));
}

}  // namespace

void FetchFailures::Note(const catalogue::Version& version, const absl::Status& status) {
  const std::string why = LastingHindrance(status);
  if (status.ok()) lasting_.erase(version.FileName());
  if (!why.empty()) lasting_[version.FileName()] = why;
  without_room_.erase(version.FileName());
  if (absl::IsResourceExhausted(status)) without_room_.insert(version.FileName());
}

absl::Status FetchFailures::WhyNotServed(const catalogue::Version& version) const {
  const std::string map = absl::StrCat("the map of region ", version.region);
  const auto lasting = lasting_.find(version.FileName());
  if (lasting == lasting_.end()) {
    return Unavailable(v1::ERROR_REASON_MAP_LOADING,
                       absl::StrCat(map,
                                    without_room_.contains(version.FileName())
                                        ? " waits for room on the server's disk"
                                        : " is being fetched",
                                    "; try again later"),
                       kRetryFetched);
  }
  return Unavailable(
      v1::ERROR_REASON_MAP_FAILED,
      absl::StrCat(map, " cannot be had: ", lasting->second, "; the server's log says more"),
      kRetryFailed);
}

}  // namespace scanloc::server

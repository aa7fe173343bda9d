#include "backoff.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "scanloc/proto/status.hpp"

namespace scanloc::client {
namespace {

using std::chrono::milliseconds;

double Least() { return 0.0; }
double Most() { return 1.0; }

const absl::Status kGone = absl::UnavailableError("gone");

std::vector<milliseconds> WaitsOf(Backoff backoff, const absl::Status& status) {
  std::vector<milliseconds> waits;
  while (const auto wait = backoff.After(status)) waits.push_back(*wait);
  return waits;
}

TEST(Backoff, DoublesUpToItsBoundAndThenGivesUp) {
  const RetryOptions options{
      .max_attempts = 6, .initial_backoff = milliseconds(100), .max_backoff = milliseconds(500)};
  using Waits = std::vector<milliseconds>;
  EXPECT_EQ(WaitsOf(Backoff(options, Most), kGone),
            (Waits{milliseconds(100), milliseconds(200), milliseconds(400), milliseconds(500),
                   milliseconds(500)}));
  EXPECT_EQ(WaitsOf(Backoff(options, Least), kGone),
            (Waits{milliseconds(50), milliseconds(100), milliseconds(200), milliseconds(250),
                   milliseconds(250)}));
}

TEST(Backoff, DoesNotRepeatWhatWouldEndTheSameWayOrMayHaveBeenDone) {
  for (const absl::StatusCode code :
       {absl::StatusCode::kInvalidArgument, absl::StatusCode::kNotFound,
        absl::StatusCode::kDeadlineExceeded, absl::StatusCode::kFailedPrecondition,
        absl::StatusCode::kInternal, absl::StatusCode::kPermissionDenied,
        absl::StatusCode::kResourceExhausted}) {
    EXPECT_TRUE(WaitsOf(Backoff({}, Most), absl::Status(code, "no")).empty()) << code;
  }
  EXPECT_TRUE(WaitsOf(Backoff({.max_attempts = 1}, Most), kGone).empty());
}

TEST(Backoff, WaitsAtLeastAsLongAsTheServerAsks) {
  const absl::Status busy = proto::WithRetryAfter(absl::ResourceExhaustedError("busy"), 0.7);
  Backoff hasty({}, Least);
  EXPECT_EQ(hasty.After(busy), milliseconds(700));
  Backoff patient({}, Most);
  EXPECT_EQ(patient.After(busy), milliseconds(1050));
}

}  // namespace
}  // namespace scanloc::client

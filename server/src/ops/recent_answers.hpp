#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/scan/sensor_mount.hpp"
#include "scanloc/proto/viewer.hpp"
#include "scanloc/v1/viewer.pb.h"

namespace scanloc::server {

/// The last answers of a server, for those who may see what others are told. The oldest goes for
/// each that comes, so that nobody who looks, or does not, keeps an answer waiting. Thread-safe.
class RecentAnswers {
 public:
  /// max_answers 0: none are kept.
  explicit RecentAnswers(int max_answers);

  [[nodiscard]] bool is_on() const { return max_answers_ > 0; }

  /// What is said, and of which scan: number and time are filled in, and what there is too much of
  /// is thinned.
  void Add(SeenAnswer answer);

  /// Those that the request asks for. InvalidArgument: bad max_answers.
  [[nodiscard]] absl::StatusOr<v1::ListAnswersResponse> List(
      const v1::ListAnswersRequest& request) const;

 private:
  using Kept = std::shared_ptr<const v1::SeenAnswer>;

  const std::size_t max_answers_;
  const std::string run_;
  mutable std::mutex mutex_;
  std::uint64_t num_seen_ = 0;
  std::deque<Kept> answers_;  // numbers without gaps, up to num_seen_
};

}  // namespace scanloc::server

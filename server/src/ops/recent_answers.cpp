#include "ops/recent_answers.hpp"

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ops/clock.hpp"
#include "scanloc/proto/convert_viewer.hpp"

namespace scanloc::server {
namespace {

void Thin(std::vector<Post>& posts) {
  const std::size_t step = (posts.size() + kMaxSeenPosts - 1) / kMaxSeenPosts;
  if (step <= 1) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < posts.size(); i += step) posts[kept++] = posts[i];
  posts.resize(kept);
}

}  // namespace

RecentAnswers::RecentAnswers(int max_answers)
    : max_answers_(max_answers),
      run_(absl::StrFormat("%08x%08x", std::random_device{}(), std::random_device{}())) {}

void RecentAnswers::Add(SeenAnswer answer) {
  answer.answered_ns = SinceEpochNs();
  Thin(answer.structure.posts);
  auto& candidates = answer.reply.answer.candidates;
  if (candidates.size() > kMaxSeenCandidates) candidates.resize(kMaxSeenCandidates);
  const auto kept = std::make_shared<v1::SeenAnswer>(proto::ToProto(answer));
  Kept oldest;  // is freed without the lock
  const std::lock_guard lock(mutex_);
  kept->set_number(++num_seen_);
  answers_.push_back(kept);
  if (answers_.size() <= max_answers_) return;
  oldest = std::move(answers_.front());
  answers_.pop_front();
}

absl::StatusOr<v1::ListAnswersResponse> RecentAnswers::List(
    const v1::ListAnswersRequest& request) const {
  if (request.max_answers() < 0 || request.max_answers() > kMaxAnswersPerPage) {
    return absl::InvalidArgumentError(absl::StrCat("max_answers is ", request.max_answers(),
                                                   "; it must lie in [0, ", kMaxAnswersPerPage,
                                                   "]"));
  }
  const auto most = static_cast<std::size_t>(request.max_answers() == 0 ? kMaxAnswersPerPage
                                                                        : request.max_answers());
  v1::ListAnswersResponse response;
  response.set_run(run_);
  std::uint64_t after = request.run() == run_ ? request.after() : 0;
  std::vector<Kept> chosen;
  {
    const std::lock_guard lock(mutex_);
    after = std::min(after, num_seen_);
    const std::uint64_t num_gone = num_seen_ - answers_.size();
    for (std::size_t i = std::max(after, num_gone) - num_gone;
         i < answers_.size() && chosen.size() < most; ++i) {
      after = num_gone + i + 1;
      if (request.map().empty() || answers_[i]->answer().map() == request.map()) {
        chosen.push_back(answers_[i]);
      }
    }
  }
  response.set_next_after(after);
  for (const Kept& answer : chosen) *response.add_answers() = *answer;
  return response;
}

}  // namespace scanloc::server

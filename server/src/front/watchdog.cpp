#include "front/watchdog.hpp"

#include <algorithm>
#include <utility>

#include "front/memory.hpp"

namespace scanloc::server {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kInterval(100);
constexpr milliseconds kBetweenQuestions(1000);
constexpr milliseconds kAfterNoAnswer(250);
constexpr milliseconds kPatience(1500);

/// A front that has not answered for so long, and at least this often, is deaf. Where another one
/// is deaf, too, it may be the question: the next one is given twice the time.
constexpr milliseconds kMaxDeafness(3000);
constexpr std::chrono::minutes kLongestDeafness(10);
constexpr int kMinUnanswered = 2;

/// The thread itself was not run for so long: nothing is known about the front.
constexpr milliseconds kOverslept(1000);

/// Memory that nothing accounts for is mostly free, and only to be given back, now and then; if so
/// much stays for so long, the front is made anew.
constexpr milliseconds kBetweenTrims(500);
constexpr milliseconds kMaxOdd(1000);
/// What a front held is freed, bit by bit, until so long after it is gone.
constexpr milliseconds kSettling(3000);

}  // namespace

Watchdog::Watchdog(Ward ward, MemoryBound& memory)
    : ward_(std::move(ward)),
      memory_(memory),
      well_(Clock::now()),
      max_deafness_(kMaxDeafness),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void Watchdog::Run(const std::stop_token& stop) {
  auto last = Clock::now();
  while (!stop.stop_requested()) {
    Ask();
    const auto now = Clock::now();
    if (now - last > kOverslept) {
      well_ = now;
      num_unanswered_ = 0;
    }
    last = now;
    LookAtMemory();
  }
}

void Watchdog::Ask() {
  const auto now = Clock::now();
  if (!is_asking_) question_.reset();
  if (question_ == nullptr && is_asking_ && now >= next_question_) {
    question_ = ward_.ask();
    asked_ = now;
  }
  if (question_ == nullptr) return std::this_thread::sleep_for(kInterval);
  const SelfCheck::Outcome outcome = question_->Await(kInterval);
  if (outcome == SelfCheck::Outcome::kNoneYet && Clock::now() - asked_ < kPatience) return;
  question_.reset();
  TakeOutcome(outcome == SelfCheck::Outcome::kAnswered);
}

void Watchdog::TakeOutcome(bool is_answered) {
  const auto now = Clock::now();
  ward_.asked(is_answered);
  if (is_answered) {
    well_ = now;
    num_unanswered_ = 0;
    max_deafness_ = kMaxDeafness;
    next_question_ = now + kBetweenQuestions;
    return;
  }
  next_question_ = now + kAfterNoAnswer;
  ++num_unanswered_;
  if (num_unanswered_ < kMinUnanswered || now - well_ < max_deafness_) return;
  max_deafness_ = std::min<std::chrono::nanoseconds>(2 * max_deafness_, kLongestDeafness);
  MakeAnew("deaf");
}

void Watchdog::LookAtMemory() {
  const auto look = [this] { return memory_.Look(ward_.work_bytes(), ward_.at_hand_bytes); };
  MemoryBound::State state = look();
  const auto now = Clock::now();
  const bool is_to_trim = state.is_over || state.has_slack || now < settled_;
  if (is_to_trim && now - last_trim_ >= kBetweenTrims) {
    ReturnFreedMemory();
    last_trim_ = now;
    state = look();
  }
  if (state.is_odd && !std::exchange(is_odd_, true)) odd_since_ = now;
  is_odd_ = state.is_odd;
  if (state.is_over || (is_odd_ && now - odd_since_ >= kMaxOdd)) MakeAnew("memory");
}

void Watchdog::MakeAnew(const std::string& why) {
  question_.reset();
  ward_.make_anew(why);
  is_odd_ = false;
  num_unanswered_ = 0;
  well_ = next_question_ = last_trim_ = Clock::now();
  settled_ = well_ + kSettling;
}

}  // namespace scanloc::server

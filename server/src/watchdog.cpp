#include "watchdog.hpp"

#include <algorithm>
#include <utility>

#include "memory.hpp"

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

/// Memory that nothing accounts for is given back after so long, and if it stays, the front is made
/// anew after so long.
constexpr milliseconds kOddBeforeTrim(300);
constexpr milliseconds kMaxOdd(5000);
/// What a front held is freed a while after it is gone.
constexpr milliseconds kTrimAfterMakingAnew(1000);

}  // namespace

Watchdog::Watchdog(Ward ward, MemoryBound& memory)
    : ward_(std::move(ward)),
      memory_(memory),
      well_(Clock::now()),
      max_deafness_(kMaxDeafness),
      thread_([this] { Run(); }) {}

Watchdog::~Watchdog() {
  is_ending_ = true;
  thread_.join();
}

void Watchdog::Run() {
  auto last = Clock::now();
  while (!is_ending_) {
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
  const DoorProbe::Outcome outcome = question_->Await(kInterval);
  if (outcome == DoorProbe::Outcome::kNoneYet && Clock::now() - asked_ < kPatience) return;
  question_.reset();
  TakeOutcome(outcome == DoorProbe::Outcome::kAnswered);
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
  const MemoryBound::State state = memory_.Look(ward_.at_hand_bytes);
  if (state.is_over) return MakeAnew("memory");
  const auto now = Clock::now();
  if (now >= trim_) {
    ReturnFreedMemory();
    trim_ = Clock::time_point::max();
  }
  if (!state.is_odd) {
    is_odd_ = is_trimmed_ = false;
    return;
  }
  if (!std::exchange(is_odd_, true)) odd_since_ = now;
  if (now - odd_since_ >= kOddBeforeTrim && !std::exchange(is_trimmed_, true)) ReturnFreedMemory();
  if (now - odd_since_ < kMaxOdd) return;
  MakeAnew("memory");
}

void Watchdog::MakeAnew(const std::string& why) {
  question_.reset();
  ward_.make_anew(why);
  is_odd_ = is_trimmed_ = false;
  num_unanswered_ = 0;
  well_ = next_question_ = Clock::now();
  trim_ = well_ + kTrimAfterMakingAnew;
}

}  // namespace scanloc::server

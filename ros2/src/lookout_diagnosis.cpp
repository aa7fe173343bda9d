// How a lookout tells people and monitors how things stand.
#include <numbers>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "lookout.hpp"
#include "scanloc/core/printable.hpp"

namespace scanloc::ros2 {
namespace {

using Level = DiagnosticMessage::Level;

void Set(DiagnosticMessage& diagnosis, Level level, std::string message) {
  diagnosis.level = level;
  diagnosis.message = std::move(message);
}

void AddAnswer(const LocalizeReply& reply, DiagnosticMessage& diagnosis) {
  const Answer& answer = reply.answer;
  diagnosis.values.emplace_back("outcome", OutcomeName(answer.outcome));
  diagnosis.values.emplace_back("reason", Printable(answer.reason));
  diagnosis.values.emplace_back("map", Printable(reply.map));
  diagnosis.values.emplace_back("content_id", Printable(answer.content_id));
  if (answer.candidates.empty()) return;
  const Candidate& best = answer.candidates.front();
  const Eigen::Vector3d position_m = best.T_map_query.translation();
  diagnosis.values.emplace_back("place", absl::StrCat(best.place));
  diagnosis.values.emplace_back("session", Printable(best.session_name));
  if (best.confidence) {
    diagnosis.values.emplace_back("confidence", absl::StrFormat("%.4f", *best.confidence));
  }
  diagnosis.values.emplace_back("robot_in_map",
                                absl::StrFormat("x %.2f m, y %.2f m, z %.2f m, heading %.1f deg",
                                                position_m.x(), position_m.y(), position_m.z(),
                                                Yaw(best.T_map_query) * 180.0 / std::numbers::pi));
}

}  // namespace

void Lookout::DiagnoseState(std::int64_t now_ns, DiagnosticMessage& diagnosis) const {
  const std::string outcome =
      last_reply_ ? OutcomeName(last_reply_->answer.outcome) : std::string("no answer yet");
  if (state_ == State::kIdle) return Set(diagnosis, Level::kOk, "waits for a trigger");
  if (!problem_.empty()) {
    return Set(diagnosis, Level::kError, absl::StrCat("no answer: ", Printable(problem_)));
  }
  if (state_ == State::kLost) {
    return Set(diagnosis, Level::kError,
               absl::StrCat("lost again: ", last_reply_ ? outcome : "odometry leapt"));
  }
  if (!cloud_problem_.empty()) {
    return Set(diagnosis, Level::kError,
               absl::StrCat("a cloud is refused: ", Printable(cloud_problem_)));
  }
  if (!unconnected_.empty()) {
    return Set(diagnosis, Level::kWarn,
               absl::StrCat("odometry is of \"", Printable(unconnected_),
                            "\" and left out: no static transform connects it with \"",
                            Printable(options_.base_frame), "\" (--base-frame)"));
  }
  if (counts_.received == 0) return Set(diagnosis, Level::kWarn, "no cloud has come");
  if (WantsScan() && now_ns >= cloud_at_ns_ + kSilence_ns) {
    return Set(diagnosis, Level::kWarn,
               absl::StrCat("no cloud has come for ", kSilence_ns / 1'000'000'000, " s"));
  }
  if (state_ == State::kSearching) {
    return Set(diagnosis, Level::kWarn, absl::StrCat("not localized: ", outcome));
  }
  if (num_misses_in_row_ > 0) {
    return Set(diagnosis, Level::kWarn, absl::StrCat("localized before, now: ", outcome));
  }
  if (!has_mount_) {
    return Set(diagnosis, Level::kWarn,
               absl::StrCat("localized, but no mount of \"", Printable(cloud_frame_),
                            "\" is known (tf_static, --T-base-sensor): the pose is the sensor's, "
                            "and odometry is left out"));
  }
  if (options_.publishes_tf && !T_map_odom_) {
    return Set(diagnosis, Level::kWarn,
               "localized, but no transform without odometry of the cloud's time");
  }
  if (options_.publishes_tf && !HasOdomFrame()) {
    return Set(diagnosis, Level::kWarn,
               absl::StrCat("localized, but odometry is in the frame \"", Printable(odom_frame_),
                            "\", to which no transform can lead; name another by --odom-frame"));
  }
  if (!is_announced_ && !options_.publishes_tf) {
    return Set(diagnosis, Level::kOk, "localized, but nobody subscribes to the initial pose");
  }
  Set(diagnosis, Level::kOk, "localized");
}

DiagnosticMessage Lookout::Diagnose(std::int64_t now_ns) const {
  constexpr const char* kStates[] = {"idle", "searching", "localized", "lost"};
  DiagnosticMessage diagnosis;
  DiagnoseState(now_ns, diagnosis);
  diagnosis.values.emplace_back("state", kStates[static_cast<int>(state_)]);
  diagnosis.values.emplace_back("clouds_received", absl::StrCat(counts_.received));
  diagnosis.values.emplace_back("clouds_asked", absl::StrCat(counts_.asked));
  diagnosis.values.emplace_back("clouds_passed_over", absl::StrCat(counts_.passed_over));
  diagnosis.values.emplace_back("clouds_refused", absl::StrCat(counts_.refused));
  diagnosis.values.emplace_back("clouds_without_odometry", absl::StrCat(counts_.without_odometry));
  diagnosis.values.emplace_back("clouds_deskewed", absl::StrCat(counts_.deskewed));
  diagnosis.values.emplace_back("errors", absl::StrCat(counts_.errors));
  if (last_reply_) AddAnswer(*last_reply_, diagnosis);
  return diagnosis;
}

}  // namespace scanloc::ros2

#include "scanloc/mapdb/map_builder.hpp"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "encoding.hpp"
#include "map_writer.hpp"
#include "open_map.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "session_plan.hpp"

namespace scanloc::mapdb {
namespace {

absl::StatusOr<MapWriter> StartMap(const std::string& path, const Params& params,
                                   const SessionPlan& plan) {
  ASSIGN_OR_RETURN(MapWriter writer, MapWriter::Open(path));
  RETURN_IF_ERROR(writer.Initialize(params));
  RETURN_IF_ERROR(writer.StartSession(plan));
  return writer;
}

// OK if the last session of the map is the plan's and its parameters are these.
absl::Status CheckIsLastSession(MapWriter& writer, const Params& params, const SessionPlan& plan) {
  const MapHead& head = writer.head();
  const SessionRow& last = head.sessions.back();
  if (const std::string difference = DescribeDifference(head.params, params); !difference.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", writer.path(), "' is built with other parameters: ", difference,
                     "; resume with those of the map, or build another map"));
  }
  if (last.plan_hash == PlanHash(plan)) return absl::OkStatus();
  if (head.complete() && last.name != plan.name) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", writer.path(), "' has no unfinished session: its last, '", last.name,
                     "', is complete; to add session '", plan.name, "' build with --append"));
  }
  ASSIGN_OR_RETURN(const std::vector<PlaceRow> places, writer.ReadLastSession());
  return absl::FailedPreconditionError(
      absl::StrCat("the last session of map '", writer.path(),
                   "' was built of another input: ", DescribeDifference(last, places, plan),
                   "; resume with the same scans, poses and options, or build another map"));
}

}  // namespace

struct MapBuilder::State {
  State(MapWriter opened, SessionPlan session_plan)
      : writer(std::move(opened)), plan(std::move(session_plan)) {}

  [[nodiscard]] std::size_t next_scan() const {
    return static_cast<std::size_t>(writer.head().sessions.back().num_done());
  }

  // OK if a further scan may come.
  [[nodiscard]] absl::Status CheckCanAdd() const {
    if (!error.ok()) return error;
    if (next_scan() < plan.scans.size()) return absl::OkStatus();
    return absl::FailedPreconditionError(absl::StrCat(
        "all ", plan.scans.size(), " scans of session '", plan.name, "' are in the map"));
  }

  // Keeps the first error, after which nothing more is written.
  absl::Status Keep(absl::Status result) {
    if (!result.ok()) error = result;
    return result;
  }

  MapWriter writer;
  SessionPlan plan;
  absl::Status error;
  bool is_released = false;
};

absl::StatusOr<MapBuilder> MapBuilder::Create(const std::string& path, const Params& params,
                                              SessionPlan plan) {
  RETURN_IF_ERROR(scanloc::Validate(params));
  RETURN_IF_ERROR(Validate(plan));
  RETURN_IF_ERROR(CreateEmptyFile(path));
  absl::StatusOr<MapWriter> writer = StartMap(path, params, plan);
  if (!writer.ok()) {
    // Unavailable: a build with --resume was quicker, and the file is its own now.
    if (!absl::IsUnavailable(writer.status())) unlink(path.c_str());
    return writer.status();
  }
  return MapBuilder(std::make_unique<State>(*std::move(writer), std::move(plan)));
}

absl::StatusOr<MapBuilder> MapBuilder::Append(const std::string& path, SessionPlan plan) {
  RETURN_IF_ERROR(Validate(plan));
  ASSIGN_OR_RETURN(MapWriter writer, MapWriter::Open(path));
  if (writer.is_new()) {
    return absl::InvalidArgumentError(
        absl::StrCat("map '", path, "' is empty; build its first session without --append"));
  }
  const std::vector<SessionRow>& sessions = writer.head().sessions;
  if (!writer.head().complete()) {
    return absl::FailedPreconditionError(
        absl::StrCat("session '", sessions.back().name, "' of map '", path, "' is unfinished, at ",
                     sessions.back().num_done(), " of ", sessions.back().num_scans,
                     " scans; finish it with --resume first"));
  }
  if (std::ranges::any_of(sessions,
                          [&](const SessionRow& session) { return session.name == plan.name; })) {
    return absl::AlreadyExistsError(absl::StrCat("map '", path, "' has a session '", plan.name,
                                                 "' already; choose another name"));
  }
  RETURN_IF_ERROR(writer.StartSession(plan));
  return MapBuilder(std::make_unique<State>(std::move(writer), std::move(plan)));
}

absl::StatusOr<MapBuilder> MapBuilder::Resume(const std::string& path, const Params& params,
                                              SessionPlan plan) {
  RETURN_IF_ERROR(scanloc::Validate(params));
  RETURN_IF_ERROR(Validate(plan));
  const absl::StatusOr<Recovery> recovery = RecoverMap(path);
  if (absl::IsNotFound(recovery.status())) return Create(path, params, std::move(plan));
  if (!recovery.ok()) return recovery.status();
  ASSIGN_OR_RETURN(MapWriter writer, MapWriter::Open(path));
  absl::Status status;
  if (writer.is_new()) {
    status = writer.Initialize(params);
    if (status.ok()) status = writer.StartSession(plan);
  } else {
    status = CheckIsLastSession(writer, params, plan);
  }
  if (!status.ok()) return status;
  return MapBuilder(std::make_unique<State>(std::move(writer), std::move(plan)));
}

MapBuilder::MapBuilder(std::unique_ptr<State> state) : state_(std::move(state)) {}
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;
MapBuilder::~MapBuilder() = default;

const Params& MapBuilder::params() const { return state_->writer.head().params; }
const SessionPlan& MapBuilder::plan() const { return state_->plan; }
std::size_t MapBuilder::next_scan() const { return state_->next_scan(); }
std::int64_t MapBuilder::num_places() const { return state_->writer.num_places(); }

absl::Status MapBuilder::Add(const PlaceDescriptor& descriptor) {
  RETURN_IF_ERROR(state_->CheckCanAdd());
  RETURN_IF_ERROR(scanloc::Validate(descriptor, params()));
  return state_->Keep(state_->writer.AddPlace(state_->plan.scans[state_->next_scan()], descriptor));
}

absl::Status MapBuilder::Skip(SkipReason reason) {
  RETURN_IF_ERROR(state_->CheckCanAdd());
  state_->writer.AddSkipped(reason);
  return absl::OkStatus();
}

absl::Status MapBuilder::Commit() {
  if (!state_->error.ok() || state_->is_released) return state_->error;
  return state_->Keep(state_->writer.Commit());
}

absl::StatusOr<std::string> MapBuilder::Finish() {
  RETURN_IF_ERROR(Commit());
  if (next_scan() < state_->plan.scans.size()) {
    return absl::FailedPreconditionError(absl::StrCat(state_->plan.scans.size() - next_scan(),
                                                      " scans of session '", state_->plan.name,
                                                      "' are left to build"));
  }
  if (!state_->is_released) {
    RETURN_IF_ERROR(state_->Keep(state_->writer.Release()));
    state_->is_released = true;
  }
  return state_->writer.head().content_id;
}

}  // namespace scanloc::mapdb

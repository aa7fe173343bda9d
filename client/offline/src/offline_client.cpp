#include "scanloc/client/offline_client.hpp"

#include <chrono>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/track/tracker.hpp"
#include "scanloc/geo/geo_frame.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/proto/as_received.hpp"

namespace scanloc::client {
namespace {

using std::chrono::milliseconds;

std::int64_t NowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// How long a call may take, and what it tells of its end.
struct Terms {
  milliseconds budget;
  std::optional<milliseconds> timeout;

  [[nodiscard]] absl::Status Check() const {
    if (budget.count() >= 0 && timeout.value_or(milliseconds(1)).count() > 0) {
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(
        absl::StrCat("the budget is ", budget.count(), " ms and the timeout ",
                     timeout.value_or(milliseconds(0)).count(),
                     " ms; the one must not be negative, the other ", "be above 0"));
  }
  /// Of a call that began then, for the search that begins now.
  [[nodiscard]] SearchControl ControlSince(std::int64_t began_ns) const {
    SearchControl control = TimedBy(&NowNs, std::chrono::nanoseconds(budget).count());
    control.run_both = &RunBoth;
    if (timeout) {
      const std::int64_t end_ns = began_ns + std::chrono::nanoseconds(*timeout).count();
      control.is_unwanted = [end_ns] { return NowNs() > end_ns; };
    }
    return control;
  }
  [[nodiscard]] absl::Status Told(const absl::Status& status) const {
    if (!absl::IsCancelled(status)) return status;
    return absl::DeadlineExceededError(absl::StrCat("no answer within ", timeout->count(), " ms"));
  }
};

}  // namespace

struct OfflineClient::State {
  [[nodiscard]] absl::Status CheckName(const std::string& map) const {
    if (map.empty() || map == info.name) return absl::OkStatus();
    return absl::NotFoundError(absl::StrCat("no map is named \"", absl::Utf8SafeCHexEscape(map),
                                            "\"; there is ", info.name));
  }

  struct Described {
    ScanDescriptor descriptor;
    ScanCounts counts;
    std::int64_t began_ns = 0;
    std::int64_t describe_ns = 0;
  };
  /// By a describer that nobody uses; it serves one thread at a time.
  [[nodiscard]] absl::StatusOr<Described> Describe(PointView scan, const SensorMount& mount) {
    RETURN_IF_ERROR(Validate(mount));
    std::optional<Describer> describer;
    {
      const std::lock_guard lock(mutex);
      if (!idle.empty()) {
        describer = std::move(idle.back());
        idle.pop_back();
      }
    }
    if (!describer)
      describer = *Describer::Create(info.params);  // was created before: they are good
    Described described{.began_ns = NowNs()};
    PointCloud buffer;
    const PointView seen = Seen(mount, scan, buffer);
    described.descriptor = describer->Describe(seen, &described.counts);
    described.counts.num_masked = scan.size() - seen.size();
    described.describe_ns = NowNs() - described.began_ns;
    const std::lock_guard lock(mutex);
    idle.push_back(*std::move(describer));
    return described;
  }

  [[nodiscard]] absl::StatusOr<LocalizeReply> Answer(const ScanDescriptor& descriptor,
                                                     const SensorMount& mount,
                                                     const RequestOptions& options,
                                                     std::int64_t began_ns) const {
    const Terms terms{options.budget, options.timeout};
    RETURN_IF_ERROR(terms.Check());
    Query query = options.query;
    ASSIGN_OR_RETURN(query.prior, geo::InMapFrame(query.prior, geo));
    auto answer = localizer->Localize(descriptor, query, terms.ControlSince(began_ns));
    if (!answer.ok()) return terms.Told(answer.status());
    TellOfBase(mount, *answer);
    geo::TellOnEarth(geo, *answer);
    proto::MakeAsReceived(*answer);
    return LocalizeReply{.answer = *std::move(answer), .map = info.name, .header = options.header};
  }

  MapInfo info;
  std::string signature;
  std::shared_ptr<const Localizer> localizer;
  std::optional<geo::GeoFrame> geo;
  std::mutex mutex;
  std::vector<Describer> idle;
};

/// A robot whose scans are weighed here.
class OfflineClient::TrackedRobot final : public RobotStream::Tracking {
 public:
  TrackedRobot(std::shared_ptr<State> state, Tracker tracker, const SensorMount& mount,
               const Terms& terms)
      : state_(std::move(state)), tracker_(std::move(tracker)), mount_(mount), terms_(terms) {}

  absl::StatusOr<TrackedReply> Locate(PointView scan, const std::optional<Pose>& T_last_scan,
                                      const ScanHeader& header) override {
    if (is_closed_) return absl::FailedPreconditionError("the stream has ended; open another");
    ASSIGN_OR_RETURN(const State::Described described, state_->Describe(scan, mount_));
    std::optional<Pose> T_last = T_last_scan;
    if (T_last) T_last = TurnedStep(mount_, proto::AsReceived(*T_last));
    auto told =
        tracker_.Update(described.descriptor, T_last, terms_.ControlSince(described.began_ns));
    if (!told.ok()) return terms_.Told(told.status());
    TellOfBase(mount_, told->answer);
    geo::TellOnEarth(state_->geo, told->answer);
    proto::MakeAsReceived(told->answer);
    told->answer.times.describe_ns = described.describe_ns;
    return TrackedReply{.reply = {.answer = std::move(told->answer),
                                  .map = state_->info.name,
                                  .scan_counts = described.counts,
                                  .header = header},
                        .num_scans = told->num_scans,
                        .is_relocated = told->is_relocated};
  }
  absl::Status Close() override {
    is_closed_ = true;
    return absl::OkStatus();
  }

 private:
  const std::shared_ptr<State> state_;
  Tracker tracker_;
  bool is_closed_ = false;
  const SensorMount mount_;
  const Terms terms_;
};

absl::StatusOr<std::shared_ptr<const OfflineClient>> OfflineClient::Open(
    const std::string& map_file, const std::string& name) {
  ASSIGN_OR_RETURN(auto map, mapdb::LoadMap(map_file));
  return Create(std::make_shared<const Map>(std::move(map)), name);
}

absl::StatusOr<std::shared_ptr<const OfflineClient>> OfflineClient::Create(
    std::shared_ptr<const Map> map, const std::string& name) {
  auto state = std::make_shared<State>();
  state->info = InfoOf(name, *map);
  state->info.generation = 1;
  state->signature = DescriptorSignature(map->params);
  if (map->geo_origin) {
    ASSIGN_OR_RETURN(state->geo, geo::GeoFrame::Create(*map->geo_origin));
  }
  ASSIGN_OR_RETURN(auto describer, Describer::Create(map->params));
  state->idle.push_back(std::move(describer));
  ASSIGN_OR_RETURN(state->localizer, Localizer::Create(std::move(map)));
  return std::shared_ptr<const OfflineClient>(new OfflineClient(std::move(state)));
}

OfflineClient::OfflineClient(std::shared_ptr<State> state) : state_(std::move(state)) {}
OfflineClient::~OfflineClient() = default;

absl::StatusOr<std::vector<MapSummary>> OfflineClient::ListMaps() const {
  const MapInfo& info = state_->info;
  return std::vector{MapSummary{.name = info.name,
                                .state = MapState::kServing,
                                .content_id = info.content_id,
                                .num_places = info.num_places,
                                .generation = info.generation}};
}

absl::StatusOr<MapInfo> OfflineClient::GetMapInfo(const std::string& map) const {
  RETURN_IF_ERROR(state_->CheckName(map));
  return state_->info;
}

absl::StatusOr<PlacesPage> OfflineClient::ListPlaces(const std::string& map,
                                                     const std::string& page_token) const {
  RETURN_IF_ERROR(state_->CheckName(map));
  auto page = PageOfPlaces(state_->localizer->map(), 0, page_token);
  if (page.ok() && state_->geo) page->geo = state_->geo->ToGeo(page->places);
  return page;
}

absl::StatusOr<LocalizeReply> OfflineClient::LocalizeScan(PointView scan,
                                                          const RequestOptions& options) const {
  RETURN_IF_ERROR(state_->CheckName(options.map));
  const SensorMount mount = proto::AsReceived(options.mount);
  ASSIGN_OR_RETURN(const State::Described described, state_->Describe(scan, mount));
  auto reply = state_->Answer(described.descriptor, mount, options, described.began_ns);
  if (!reply.ok()) return reply;
  reply->answer.times.describe_ns = described.describe_ns;
  reply->scan_counts = described.counts;
  return reply;
}

absl::StatusOr<LocalizeReply> OfflineClient::LocalizeDescriptor(
    const SignedDescriptor& descriptor, const RequestOptions& options) const {
  RETURN_IF_ERROR(state_->CheckName(options.map));
  if (descriptor.signature != state_->signature) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the descriptors were made with \"", absl::Utf8SafeCHexEscape(descriptor.signature),
        "\" but map ", state_->info.name, " has \"", state_->signature,
        "\"; describe the scan with the map's parameters"));
  }
  return state_->Answer(descriptor.descriptor, SensorMount(), options, NowNs());
}

absl::StatusOr<RobotStream> OfflineClient::OpenStream(const StreamOptions& options) const {
  RETURN_IF_ERROR(state_->CheckName(options.map));
  const Terms terms{options.budget, options.timeout};
  RETURN_IF_ERROR(terms.Check());
  TrackerOptions tracked{.query = options.query, .max_step_m = options.max_step_m};
  ASSIGN_OR_RETURN(tracked.query.prior, geo::InMapFrame(options.query.prior, state_->geo));
  ASSIGN_OR_RETURN(auto tracker, Tracker::Create(state_->localizer, tracked));
  return RobotStream(std::make_unique<TrackedRobot>(state_, std::move(tracker),
                                                    proto::AsReceived(options.mount), terms));
}

}  // namespace scanloc::client

#include "scanloc/client/offline_client.hpp"

#include <chrono>
#include <mutex>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::client {
namespace {

std::int64_t NowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

struct OfflineClient::State {
  [[nodiscard]] absl::Status CheckName(const std::string& map) const {
    if (map.empty() || map == info.name) return absl::OkStatus();
    return absl::NotFoundError(absl::StrCat("no map is named \"", absl::Utf8SafeCHexEscape(map),
                                            "\"; there is ", info.name));
  }

  /// A describer that nobody uses; it serves one thread at a time.
  [[nodiscard]] Describer Borrow() {
    const std::lock_guard lock(mutex);
    if (idle.empty()) return *Describer::Create(info.params);  // was created before: they are good
    Describer describer = std::move(idle.back());
    idle.pop_back();
    return describer;
  }
  void Return(Describer describer) {
    const std::lock_guard lock(mutex);
    idle.push_back(std::move(describer));
  }

  [[nodiscard]] absl::StatusOr<LocalizeReply> Answer(const ScanDescriptor& descriptor,
                                                     const RequestOptions& options) const {
    if (options.budget.count() < 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("the budget is ", options.budget.count(), " ms; it must not be negative"));
    }
    auto answer =
        localizer->Localize(descriptor, options.query,
                            TimedBy(&NowNs, std::chrono::nanoseconds(options.budget).count()));
    if (!answer.ok()) return answer.status();
    return LocalizeReply{.answer = *std::move(answer), .map = info.name};
  }

  MapInfo info;
  std::string signature;
  std::shared_ptr<const Localizer> localizer;
  std::mutex mutex;
  std::vector<Describer> idle;
};

absl::StatusOr<std::shared_ptr<const OfflineClient>> OfflineClient::Open(
    const std::string& map_file, const std::string& name) {
  auto map = mapdb::LoadMap(map_file);
  if (!map.ok()) return map.status();
  auto state = std::make_unique<State>();
  state->info = InfoOf(name, *map);
  state->info.generation = 1;
  state->signature = DescriptorSignature(map->params);
  auto describer = Describer::Create(map->params);
  if (!describer.ok()) return describer.status();
  state->Return(*std::move(describer));
  auto localizer = Localizer::Create(std::make_shared<const Map>(*std::move(map)));
  if (!localizer.ok()) return localizer.status();
  state->localizer = *std::move(localizer);
  return std::shared_ptr<const OfflineClient>(new OfflineClient(std::move(state)));
}

OfflineClient::OfflineClient(std::unique_ptr<State> state) : state_(std::move(state)) {}
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
  if (auto status = state_->CheckName(map); !status.ok()) return status;
  return state_->info;
}

absl::StatusOr<LocalizeReply> OfflineClient::LocalizeScan(PointView scan,
                                                          const RequestOptions& options) const {
  if (auto status = state_->CheckName(options.map); !status.ok()) return status;
  Describer describer = state_->Borrow();
  ScanCounts counts;
  const std::int64_t start_ns = NowNs();
  const ScanDescriptor descriptor = describer.Describe(scan, &counts);
  const std::int64_t describe_ns = NowNs() - start_ns;
  state_->Return(std::move(describer));
  auto reply = state_->Answer(descriptor, options);
  if (!reply.ok()) return reply;
  reply->answer.times.describe_ns = describe_ns;
  reply->scan_counts = counts;
  return reply;
}

absl::StatusOr<LocalizeReply> OfflineClient::LocalizeDescriptor(
    const SignedDescriptor& descriptor, const RequestOptions& options) const {
  if (auto status = state_->CheckName(options.map); !status.ok()) return status;
  if (descriptor.signature != state_->signature) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the descriptors were made with \"", absl::Utf8SafeCHexEscape(descriptor.signature),
        "\" but map ", state_->info.name, " has \"", state_->signature,
        "\"; describe the scan with the map's parameters"));
  }
  return state_->Answer(descriptor.descriptor, options);
}

}  // namespace scanloc::client

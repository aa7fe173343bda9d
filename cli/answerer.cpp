#include "cli/answerer.hpp"

#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "cli/connection_options.hpp"
#include "scanloc/client/client.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

std::int64_t NowNs() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

class FileAnswerer : public Answerer {
 public:
  FileAnswerer(std::shared_ptr<const Localizer> localizer, Describer describer)
      : localizer_(std::move(localizer)), describer_(std::move(describer)) {}

  [[nodiscard]] const Params& params() const override { return localizer_->map().params; }

  [[nodiscard]] absl::StatusOr<Answer> Ask(PointView scan, const Query& query,
                                           std::chrono::milliseconds budget) override {
    const std::int64_t start_ns = NowNs();
    const ScanDescriptor descriptor = describer_.Describe(scan);
    const std::int64_t describe_ns = NowNs() - start_ns;
    absl::StatusOr<Answer> answer = localizer_->Localize(descriptor, query, Timed(budget));
    if (answer.ok()) answer->times.describe_ns = describe_ns;
    return answer;
  }

  [[nodiscard]] absl::StatusOr<Answer> AskDescribed(const SignedDescriptor& described,
                                                    const Query& query,
                                                    std::chrono::milliseconds budget) override {
    const std::string own = DescriptorSignature(params());
    if (described.signature != own) {
      return absl::FailedPreconditionError(absl::StrCat(
          "the descriptors were made with \"", absl::CHexEscape(described.signature),
          "\" but the map has \"", own, "\"; replay them on a map of the same parameters"));
    }
    return localizer_->Localize(described.descriptor, query, Timed(budget));
  }

  [[nodiscard]] absl::StatusOr<TrackedAnswer> AskNext(PointView scan,
                                                      const std::optional<Pose>& T_last_scan,
                                                      const TrackerOptions& options,
                                                      std::chrono::milliseconds budget) override {
    if (!tracker_.has_value()) {
      absl::StatusOr<Tracker> tracker = Tracker::Create(localizer_, options);
      if (!tracker.ok()) return tracker.status();
      tracker_ = *std::move(tracker);
    }
    const std::int64_t start_ns = NowNs();
    const ScanDescriptor descriptor = describer_.Describe(scan);
    const std::int64_t describe_ns = NowNs() - start_ns;
    absl::StatusOr<TrackedAnswer> told = tracker_->Update(descriptor, T_last_scan, Timed(budget));
    if (told.ok()) told->answer.times.describe_ns = describe_ns;
    return told;
  }

 private:
  [[nodiscard]] static SearchControl Timed(std::chrono::milliseconds budget) {
    return TimedBy(&NowNs, std::chrono::nanoseconds(budget).count());
  }

  std::shared_ptr<const Localizer> localizer_;
  Describer describer_;
  std::optional<Tracker> tracker_;
};

class ServerAnswerer : public Answerer {
 public:
  ServerAnswerer(client::Client client, Params params, const ServerQuery& query)
      : client_(std::move(client)),
        params_(std::move(params)),
        map_(query.map),
        send_descriptor_(query.send_descriptor) {}

  [[nodiscard]] const Params& params() const override { return params_; }

  [[nodiscard]] absl::StatusOr<Answer> Ask(PointView scan, const Query& query,
                                           std::chrono::milliseconds budget) override {
    const client::RequestOptions request{.map = map_, .query = query, .budget = budget};
    absl::StatusOr<LocalizeReply> reply = send_descriptor_
                                              ? client_.LocalizeByDescriptor(scan, request)
                                              : client_.LocalizeScan(scan, request);
    if (!reply.ok()) return reply.status();
    return std::move(reply->answer);
  }

  [[nodiscard]] absl::StatusOr<Answer> AskDescribed(const SignedDescriptor& described,
                                                    const Query& query,
                                                    std::chrono::milliseconds budget) override {
    absl::StatusOr<LocalizeReply> reply =
        client_.LocalizeDescriptor(described, {.map = map_, .query = query, .budget = budget});
    if (!reply.ok()) return reply.status();
    return std::move(reply->answer);
  }

  [[nodiscard]] absl::StatusOr<TrackedAnswer> AskNext(PointView scan,
                                                      const std::optional<Pose>& T_last_scan,
                                                      const TrackerOptions& options,
                                                      std::chrono::milliseconds budget) override {
    if (!stream_.has_value()) {
      absl::StatusOr<client::RobotStream> stream =
          client_.OpenStream({.map = map_,
                              .query = options.query,
                              .max_step_m = options.max_step_m,
                              .send_descriptor = send_descriptor_,
                              .budget = budget});
      if (!stream.ok()) return stream.status();
      stream_ = *std::move(stream);
    }
    absl::StatusOr<TrackedReply> told = stream_->Locate(scan, T_last_scan);
    if (!told.ok()) return told.status();
    return TrackedAnswer{std::move(told->reply.answer), told->num_scans, told->is_relocated};
  }

 private:
  client::Client client_;
  Params params_;
  std::string map_;
  bool send_descriptor_;
  std::optional<client::RobotStream> stream_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Answerer>> AnswerFromFile(const std::string& path) {
  absl::StatusOr<Map> map = mapdb::LoadMap(path);
  if (!map.ok()) return map.status();
  absl::StatusOr<Describer> describer = Describer::Create(map->params);
  if (!describer.ok()) return describer.status();
  absl::StatusOr<std::shared_ptr<const Localizer>> localizer =
      Localizer::Create(std::make_shared<const Map>(*std::move(map)));
  if (!localizer.ok()) return localizer.status();
  return std::make_unique<FileAnswerer>(*std::move(localizer), *std::move(describer));
}

absl::StatusOr<std::unique_ptr<Answerer>> AnswerFromServer(const ServerQuery& query) {
  absl::StatusOr<client::Client> client = Connect(query);
  if (!client.ok()) return client.status();
  absl::StatusOr<MapInfo> info = client->GetMapInfo(query.map);
  if (!info.ok()) return info.status();
  return std::make_unique<ServerAnswerer>(*std::move(client), std::move(info->params), query);
}

}  // namespace scanloc::cli

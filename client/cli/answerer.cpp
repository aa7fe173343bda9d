#include "cli/answerer.hpp"

#include <utility>

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

  [[nodiscard]] absl::StatusOr<Answer> Ask(PointView scan, const QueryOptions& options) override {
    const std::int64_t start_ns = NowNs();
    const ScanDescriptor descriptor = describer_.Describe(scan);
    const std::int64_t describe_ns = NowNs() - start_ns;
    QueryOptions timed = options;
    timed.now_ns = &NowNs;
    absl::StatusOr<Answer> answer = localizer_->Localize(descriptor, timed);
    if (answer.ok()) answer->times.describe_ns = describe_ns;
    return answer;
  }

 private:
  std::shared_ptr<const Localizer> localizer_;
  Describer describer_;
};

class ServerAnswerer : public Answerer {
 public:
  ServerAnswerer(client::Client client, Params params, const ServerQuery& query)
      : client_(std::move(client)),
        params_(std::move(params)),
        map_(query.map),
        send_descriptor_(query.send_descriptor) {}

  [[nodiscard]] const Params& params() const override { return params_; }

  [[nodiscard]] absl::StatusOr<Answer> Ask(PointView scan, const QueryOptions& options) override {
    const client::RequestOptions request{.map = map_, .query = options};
    absl::StatusOr<LocalizeReply> reply = send_descriptor_
                                              ? client_.LocalizeByDescriptor(scan, request)
                                              : client_.LocalizeScan(scan, request);
    if (!reply.ok()) return reply.status();
    return std::move(reply->answer);
  }

 private:
  client::Client client_;
  Params params_;
  std::string map_;
  bool send_descriptor_;
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
  absl::StatusOr<client::Client> client = client::Client::Connect(
      {.address = query.address, .timeout = query.deadline, .connect_timeout = query.deadline});
  if (!client.ok()) return client.status();
  absl::StatusOr<MapInfo> info = client->GetMapInfo(query.map);
  if (!info.ok()) return info.status();
  return std::make_unique<ServerAnswerer>(*std::move(client), std::move(info->params), query);
}

}  // namespace scanloc::cli

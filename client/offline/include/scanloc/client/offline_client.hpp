#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/client/localization_client.hpp"

namespace scanloc::client {

/// Answers from a map file in this process, as a server of the same map would: for robots without a
/// network, and for tests. Queries run on the calling thread.
class OfflineClient : public LocalizationClient {
 public:
  /// Loads and checks the map, which is known by the name. Errors as of mapdb::LoadMap.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const OfflineClient>> Open(
      const std::string& map_file, const std::string& name = "map");

  /// The same of a map in memory. Errors as of Localizer::Create.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const OfflineClient>> Create(
      std::shared_ptr<const Map> map, const std::string& name = "map");

  ~OfflineClient() override;
  OfflineClient(const OfflineClient&) = delete;
  OfflineClient& operator=(const OfflineClient&) = delete;

  [[nodiscard]] absl::StatusOr<std::vector<MapSummary>> ListMaps() const override;
  [[nodiscard]] absl::StatusOr<MapInfo> GetMapInfo(const std::string& map = "") const override;
  [[nodiscard]] absl::StatusOr<PlacesPage> ListPlaces(
      const std::string& map = "", const std::string& page_token = "") const override;
  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeScan(
      PointView scan, const RequestOptions& options = {}) const override;
  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeDescriptor(
      const SignedDescriptor& descriptor, const RequestOptions& options = {}) const override;
  [[nodiscard]] absl::StatusOr<RobotStream> OpenStream(
      const StreamOptions& options = {}) const override;

 private:
  class TrackedRobot;
  struct State;
  explicit OfflineClient(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;  // streams share it
};

}  // namespace scanloc::client

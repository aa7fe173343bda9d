#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/client/localization_client.hpp"
#include "scanloc/client/robot_stream.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/proto/messages.hpp"
#include "scanloc/proto/viewer.hpp"

namespace scanloc::client {

/// How often and when a query is asked again that ended with Unavailable, or with
/// ResourceExhausted and a time to come back. Queries change nothing, so asking twice is safe;
/// streams and administration are never repeated. The call's timeout holds for all attempts.
struct RetryOptions {
  int max_attempts = 4;  ///< the first included; 1: never again
  /// Waits are drawn from half to all of this, which doubles with each attempt up to max_backoff.
  std::chrono::milliseconds initial_backoff{50};
  std::chrono::milliseconds max_backoff{2000};
};

struct ClientOptions {
  std::string address = "127.0.0.1:50061";  ///< HOST:PORT of scanlocd

  /// Encryption, files in PEM format. With a CA, the server must show a certificate of it, for the
  /// address's host; empty: no encryption.
  std::string tls_ca_file;
  std::string tls_cert_file;  ///< the robot's own, where the server asks for one; with its key
  std::string tls_key_file;
  std::string tls_server_name;  ///< whom the certificate must be for; empty: the address's host

  /// Shown with every call; empty: none. Without encryption it is sent to this machine only, unless
  /// allow_plaintext_token says that something else protects the way.
  std::string token;
  bool allow_plaintext_token = false;

  /// How long a call may take in all unless it says otherwise. A robot that waits longer than this
  /// is better off asking again with a fresh scan.
  std::chrono::milliseconds timeout{5000};

  /// How long Connect waits for the server; 0: it does not, and the first call connects.
  std::chrono::milliseconds connect_timeout{5000};

  RetryOptions retry;
};

/// OK, or InvalidArgument that names the first bad field; times reach to one hour.
[[nodiscard]] absl::Status Validate(const ClientOptions& options);

/// Asks a scanlocd. Blocking; any number of threads may call at once over the one connection.
///
/// Every call ends in time: DeadlineExceeded if the server does not answer within the timeout,
/// Unavailable if it cannot be reached. A lost connection is made again by later calls. Errors
/// carry the server's text and address; its codes are those of proto/scanloc/v1/localization.proto.
class Client : public LocalizationClient {
 public:
  /// Unavailable if the server cannot be reached now, or does not show the certificate that it
  /// should; InvalidArgument for bad options and files that cannot be read.
  [[nodiscard]] static absl::StatusOr<Client> Connect(const ClientOptions& options);

  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client() override;

  [[nodiscard]] absl::StatusOr<std::vector<MapSummary>> ListMaps() const override;

  [[nodiscard]] absl::StatusOr<MapInfo> GetMapInfo(const std::string& map = "") const override;

  [[nodiscard]] absl::StatusOr<PlacesPage> ListPlaces(
      const std::string& map = "", const std::string& page_token = "") const override;

  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeScan(
      PointView scan, const RequestOptions& options = {}) const override;

  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeDescriptor(
      const SignedDescriptor& descriptor, const RequestOptions& options = {}) const override;

  /// Fetches the map's parameters at the first query and whenever the server has got others.
  /// Without a map's name, where the server has several, the scan is sent as it is.
  [[nodiscard]] absl::StatusOr<LocalizeReply> LocalizeByDescriptor(
      PointView scan, const RequestOptions& options = {}) const override;

  [[nodiscard]] absl::StatusOr<RobotStream> OpenStream(
      const StreamOptions& options = {}) const override;

  /// What people look at (proto/scanloc/v1/viewer.proto).
  [[nodiscard]] absl::StatusOr<PlaceDetails> GetPlace(const std::string& map,
                                                      std::int32_t place) const;
  [[nodiscard]] absl::StatusOr<ConfusablePairs> ListConfusablePairs(const std::string& map) const;
  /// How the map fared in use, all places that were seen. Aborted: it was replaced meanwhile.
  [[nodiscard]] absl::StatusOr<MapUse> GetMapUse(const std::string& map) const;
  /// Those after the last page; a default one begins with the oldest that is kept.
  [[nodiscard]] absl::StatusOr<AnswersPage> ListAnswers(const std::string& map,
                                                        const AnswersPage& last = {}) const;

  /// Whether the server answers for the map; an empty name: for all that it has to serve. Needs no
  /// token. Not repeated. NotFound: it does not know the map.
  [[nodiscard]] absl::StatusOr<bool> IsServing(const std::string& map = "") const;

  /// What an operator may do, if the server serves administration and the token allows it
  /// (proto/scanloc/v1/admin.proto): the map as it then is. A map takes its time to load; the
  /// timeout must allow for it.
  [[nodiscard]] absl::StatusOr<MapSummary> ReloadMap(
      const std::string& map, std::optional<std::chrono::milliseconds> timeout = {}) const;
  [[nodiscard]] absl::StatusOr<MapSummary> LoadMap(
      const std::string& map, std::optional<std::chrono::milliseconds> timeout = {}) const;
  absl::Status UnloadMap(const std::string& map) const;

 private:
  class ServedRobot;
  struct State;
  explicit Client(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;  // streams share it
};

}  // namespace scanloc::client

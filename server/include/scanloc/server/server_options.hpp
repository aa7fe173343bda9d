#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/limits.hpp"

namespace scanloc::server {

/// One map that the server answers for: the name that requests give, and the file on this machine.
struct MapSource {
  std::string name;  ///< letters, digits, '.', '_' and '-'; it stands in health names and logs
  std::string path;

  friend bool operator==(const MapSource&, const MapSource&) = default;
};

/// Splits NAME=FILE at the first '='. InvalidArgument if there is none or a side is empty.
[[nodiscard]] absl::StatusOr<MapSource> ParseMapSource(const std::string& text);

/// OK, or InvalidArgument: not one to limits::kMaxNameBytes letters, digits, '.', '_' or '-'.
[[nodiscard]] absl::Status CheckMapName(const std::string& name);

/// Maps that are fetched as robots ask for them. No catalogue: none are.
struct CatalogueOptions {
  std::string catalogue;  ///< as catalogue::OpenCatalogue takes it
  std::string store;      ///< as catalogue::OpenStore takes it
  std::string cache_dir;  ///< folder for the maps that were fetched, of this server alone
  /// Of the disk that these may take [bytes].
  std::int64_t cache_bytes = std::int64_t{20} << 30;

  [[nodiscard]] bool enabled() const { return !catalogue.empty(); }
};

/// Encryption: files in PEM format. All empty: none.
struct TlsOptions {
  std::string cert_file;  ///< of the server, with its chain
  std::string key_file;   ///< private key of the certificate
  std::string
      client_ca_file;  ///< clients must show a certificate of this CA; empty: they need none

  [[nodiscard]] bool enabled() const { return !cert_file.empty(); }
};

/// Which requests stand in the log, a line each, at most so many a second.
enum class RequestLog : std::uint8_t { kNone, kFailed, kAll };

/// How a server runs. What shapes its answers is not here but in the maps.
struct ServerOptions {
  std::vector<MapSource> maps;  ///< at least one, unless there is a folder or a catalogue

  /// A folder whose files *.scanloc are served, too, each by its name without the ending, and from
  /// which an operator may load others later. Empty: none.
  std::string maps_dir;

  /// Regions of a catalogue are served by their names, too, once a robot asks for them.
  CatalogueOptions catalogue;

  /// Serves scanloc.v1.Admin to tokens of the role admin. Needs a token file.
  bool admin = false;

  /// HOST:PORT, or [HOST]:PORT for IPv6; port 0 takes a free one. By default only this machine
  /// reaches the server.
  std::string listen = "127.0.0.1:50061";

  TlsOptions tls;
  /// Without TLS only this machine's own addresses may be listened on, unless this says so: whoever
  /// is on the network could read and change what robots are told.
  bool allow_plaintext = false;

  /// Who may call: lines NAME ROLE TOKEN (docs/operations.md), read again when the file changes.
  /// Empty: whoever reaches the server may ask it.
  std::string token_file;

  /// Threads that answer queries; 0: one a core. A query keeps one core busy from start to end, so
  /// more than that only adds waiting.
  int num_threads = 0;

  /// Queries that run or wait for a thread; one more is refused at once with ResourceExhausted.
  /// At some milliseconds a query this is a queue of well under a second, so that what is accepted
  /// is answered while the robot still waits.
  int max_inflight = 64;

  /// How long a query may have to wait for a thread, as those before it last on the average [s];
  /// one that would wait longer is refused at once. What is accepted is then answered in time,
  /// however much is asked, whether queries take a tenth of a millisecond or ten.
  double max_wait_s = 0.1;

  /// Requests a second that one client may send, with a second's worth at once; 0: as many as it
  /// likes. A client is a token, else a certificate's name, else an address: behind a proxy without
  /// tokens all robots are one client.
  double max_rate_per_s = 0.0;

  /// Robots on a stream at once; one more is refused at once with ResourceExhausted. Each holds a
  /// connection and some kilobytes.
  int max_streams = 1000;

  /// Of these, for one client, so that none can take them all; 0: all. Behind a proxy without
  /// tokens all robots are one client.
  int max_streams_per_client = 100;

  /// How long a robot on a stream may stay silent, or leave its answer unread [s].
  double stream_idle_s = 300.0;

  /// Points of one scan; a larger one is refused before it is described. A 128-ray sensor gives at
  /// most 0.3 million.
  int max_points = 600'000;

  /// Candidates that one query may have compared. A query that asks for more is refused; where the
  /// map's own choice is more, it is cut to this.
  int max_candidates = limits::kMaxCandidates;

  /// Takes the methods that compare every place or every shift (-brute, -naive), of which one query
  /// may take a thread for seconds.
  bool allow_slow_methods = false;

  /// HOST:PORT where metrics are served over HTTP; empty: nowhere. Port 0 takes a free one. Nothing
  /// protects them there, so that beyond this machine's own addresses they are only served if this
  /// or allow_plaintext says so.
  std::string metrics_listen;
  bool allow_plaintext_metrics = false;

  /// Answers kept in memory for those who may see what others are told (tokens of the roles view
  /// and admin; without a token file, everybody): some kilobytes each. 0: none.
  int recent_answers = 0;

  /// How often it is written beside each map how its places fare in use [s]; 0: that is not
  /// counted.
  double map_health_s = 30.0;

  RequestLog log_requests = RequestLog::kFailed;

  /// A folder, made if there is none, where queries without a place are kept for replay, and what
  /// its files may take of the disk [bytes]: the oldest go first. Empty: none are kept.
  std::string capture_dir;
  std::int64_t max_capture_bytes = std::int64_t{1} << 30;

  /// Largest request [bytes]; a larger one is refused unread. The default fits a scan of
  /// max_points.
  int max_message_bytes = 8 << 20;

  /// Memory for requests that are being received or wait [bytes], whoever sends them. Beyond it
  /// further ones are refused and, if that does not do, connections lose calls.
  std::int64_t max_memory_bytes = std::int64_t{512} << 20;

  /// How long a request may take to arrive once its call has begun [s].
  double receive_s = 10.0;

  /// Tells of its services by gRPC's server reflection.
  bool reflection = true;

  /// Memory for contexts and structures of places that were compared last, of all maps [bytes];
  /// what is not there is read from the map files.
  std::int64_t cache_bytes = std::int64_t{256} << 20;

  /// A map whose file has at most so many bytes is read into memory as a whole: it then answers a
  /// little faster, and whatever becomes of its file. A larger one answers as soon as its keys are
  /// read, needs a tenth of the memory, and reads what it compares from its file.
  std::int64_t whole_bytes = std::int64_t{64} << 20;

  /// How long queries in flight may take to end once the server has been told to stop [s]; those
  /// that have not started by then are cancelled.
  double drain_s = 10.0;
};

/// Largest request that can be of use [bytes]: max_message_bytes, or less if max_points need less.
[[nodiscard]] int LargestMessageBytes(const ServerOptions& options);

/// OK, or InvalidArgument that names the first bad field, its value and what it may be.
[[nodiscard]] absl::Status Validate(const ServerOptions& options);

}  // namespace scanloc::server

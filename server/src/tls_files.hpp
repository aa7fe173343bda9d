#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "metrics.hpp"
#include "scanloc/server/server_options.hpp"

namespace scanloc::server {

/// What the files of TlsOptions hold.
struct TlsMaterial {
  std::string cert;            ///< of the server with its chain, PEM
  std::string key;             ///< PEM
  std::string client_ca;       ///< PEM; empty: clients need no certificate
  std::int64_t expires_s = 0;  ///< when the server's certificate expires [Unix time, s]

  friend bool operator==(const TlsMaterial&, const TlsMaterial&) = default;
};

/// The certificate, key and clients' CA of a server. The files are looked at every second; what is
/// new takes the place of what was before once key and certificate belong together and all of it
/// can be used. While it is bad, what was before stays in force, and log and metrics say so; a pair
/// that is replaced one file after the other is not bad unless it stays so for a second.
/// Thread-safe.
class TlsFiles {
 public:
  /// The metrics must outlive it. InvalidArgument that names the file: it cannot be read or used,
  /// or key and certificate do not belong together.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<TlsFiles>> Open(const TlsOptions& options,
                                                                      Metrics& metrics);
  ~TlsFiles();
  TlsFiles(const TlsFiles&) = delete;
  TlsFiles& operator=(const TlsFiles&) = delete;

  /// What is in force; the same object as long as it is.
  [[nodiscard]] std::shared_ptr<const TlsMaterial> Current() const;

  [[nodiscard]] bool is_mutual() const { return !options_.client_ca_file.empty(); }

 private:
  TlsFiles(TlsOptions options, Metrics& metrics)
      : options_(std::move(options)), metrics_(metrics) {}

  void Watch();
  void Look();
  void TakeUp(TlsMaterial material);
  void Refuse(const absl::Status& why, const TlsMaterial& found);

  const TlsOptions options_;
  Metrics& metrics_;
  // Of the watching thread: what was bad at its last look, why, and whether that was told.
  TlsMaterial bad_;
  absl::Status why_bad_;
  bool is_told_ = false;
  mutable std::mutex mutex_;
  std::condition_variable ends_;
  bool is_ending_ = false;
  std::shared_ptr<const TlsMaterial> current_;
  std::thread thread_;
};

}  // namespace scanloc::server

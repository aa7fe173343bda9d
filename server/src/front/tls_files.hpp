#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "ops/file_watch.hpp"
#include "ops/metrics.hpp"
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

/// The certificate, key and clients' CA of a server, as FileWatch takes them up: what is new takes
/// the place of what was before once key and certificate belong together and all of it can be used.
/// Thread-safe.
class TlsFiles {
 public:
  /// The metrics must outlive it. InvalidArgument that names the file: it cannot be read or used,
  /// or key and certificate do not belong together.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<TlsFiles>> Open(const TlsOptions& options,
                                                                      Metrics& metrics);
  /// What is in force; the same object as long as it is.
  [[nodiscard]] std::shared_ptr<const TlsMaterial> Current() const;

  [[nodiscard]] bool is_mutual() const { return !options_.client_ca_file.empty(); }

 private:
  TlsFiles(const TlsOptions& options, Metrics& metrics);

  [[nodiscard]] absl::Status TakeUp(const FileWatch::Texts& texts);

  const TlsOptions options_;
  Metrics& metrics_;
  mutable std::mutex mutex_;  // guards current_
  std::shared_ptr<const TlsMaterial> current_;
  FileWatch watch_;
};

}  // namespace scanloc::server

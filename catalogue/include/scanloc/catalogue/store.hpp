#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

/// Where map files are, by name. What is there under a name never changes.
namespace scanloc::catalogue {

/// Thread-safe. Unavailable: the store cannot be reached, or is slower than StoreOptions allow.
class Store {
 public:
  virtual ~Store() = default;

  /// Copies a file there. Until it is complete, what was there under the name stays: nothing, or
  /// the same file, which may have been damaged meanwhile. A store that has it already, and can
  /// show that it is whole, is left as it is: a folder, and a server that gives the MD5 as ETag.
  [[nodiscard]] virtual absl::Status Put(const std::string& name, const std::string& path) = 0;

  /// Copies the file to a path, over what is there, and fails if it would have more than max_bytes.
  /// go_on is asked now and then; false ends it with Cancelled. NotFound. On failure there may be a
  /// part of it.
  [[nodiscard]] virtual absl::Status Get(const std::string& name, const std::string& path,
                                         std::int64_t max_bytes,
                                         const std::function<bool()>& go_on) = 0;
};

struct StoreOptions {
  double connect_s = 5.0;
  /// A transfer that stays below so many bytes a second for so long is given up.
  std::int64_t least_bytes_per_s = 10'000;
  double slow_s = 20.0;
};

/// A folder by its path, any web server by `http://` or `https://` and the path of a folder there
/// (Put needs a server that takes PUT), or S3 by `s3://BUCKET/PREFIX?endpoint=URL&region=NAME` with
/// the keys in $AWS_ACCESS_KEY_ID and $AWS_SECRET_ACCESS_KEY. InvalidArgument: none of these.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Store>> OpenStore(const std::string& url,
                                                               const StoreOptions& options = {});

/// Of a file, 64 hex digits. NotFound and such: it cannot be read.
[[nodiscard]] absl::StatusOr<std::string> Sha256OfFile(const std::string& path);
/// Likewise, 32 hex digits: what S3 tells files by.
[[nodiscard]] absl::StatusOr<std::string> Md5OfFile(const std::string& path);

}  // namespace scanloc::catalogue

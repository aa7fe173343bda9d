#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/catalogue/area.hpp"

/// Which map of each region is in force, who published it when, and what was before.
namespace scanloc::catalogue {

/// One map file that was published for a region.
struct Version {
  std::string region;  ///< letters, digits, '.', '_' and '-': the name by which robots ask for it
  std::string content_id;  ///< of the map
  std::string sha256;  ///< of the file, 64 hex digits: tells wrong bytes before they are looked at
  std::int64_t num_bytes = 0;
  std::int64_t num_places = 0;
  Area area;  ///< of its places
  std::string published_by;
  std::int64_t published_ms = 0;  ///< Unix, by the catalogue's clock

  /// The name of the file in a store: the content id, and a part of the hash, since files of one
  /// content may differ in bytes.
  [[nodiscard]] std::string FileName() const;

  friend bool operator==(const Version&, const Version&) = default;
};

/// InvalidArgument: a field that no catalogue could hold, or that could do harm as a name of a
/// file.
[[nodiscard]] absl::Status Validate(const Version& version);

/// Not thread-safe; each thread opens its own. Unavailable: the catalogue cannot be reached;
/// another call tries anew.
class Catalogue {
 public:
  virtual ~Catalogue() = default;

  /// Records the version and puts it in force, both or neither. Of two at once the later stays in
  /// force; both are recorded.
  [[nodiscard]] virtual absl::Status Publish(const Version& version) = 0;

  /// Puts the last other file that was published before the one in force, or the one of a content
  /// id, in force again and gives it. NotFound: there is none.
  [[nodiscard]] virtual absl::StatusOr<Version> Rollback(const std::string& region,
                                                         const std::string& content_id) = 0;

  /// From then on no version of the region is in force. NotFound: none was.
  [[nodiscard]] virtual absl::Status Withdraw(const std::string& region) = 0;

  /// Those in force, by region.
  [[nodiscard]] virtual absl::StatusOr<std::vector<Version>> Live() = 0;

  /// All versions ever published for a region, the latest first.
  [[nodiscard]] virtual absl::StatusOr<std::vector<Version>> History(const std::string& region) = 0;

  /// Waits until what is in force may have changed, at most so long.
  [[nodiscard]] virtual absl::Status AwaitChange(std::chrono::milliseconds longest) = 0;
};

/// A database by `postgresql://USER@HOST/DATABASE` (libpq's URL; its tables are made if there are
/// none), or a folder by its path, made if there is none. InvalidArgument: neither.
[[nodiscard]] absl::StatusOr<std::unique_ptr<Catalogue>> OpenCatalogue(const std::string& url);

}  // namespace scanloc::catalogue

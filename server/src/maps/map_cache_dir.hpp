#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::server {

/// The folder into which maps are fetched: a file a version, and what the catalogue said last.
/// Thread-safe, but two threads must not be at one version.
class MapCacheDir {
 public:
  /// Makes the folder if there is none, takes it for this process, and removes what an interrupted
  /// fetch left. AlreadyExists: another process has it.
  [[nodiscard]] static absl::StatusOr<MapCacheDir> Open(const std::string& folder);

  [[nodiscard]] std::string PathOf(const catalogue::Version& version) const;
  /// Where it is written before it is checked.
  [[nodiscard]] std::string PartOf(const catalogue::Version& version) const;
  /// Whether the file is there, with its size.
  [[nodiscard]] bool Has(const catalogue::Version& version) const;
  /// Gives the part its name if it was fetched and its bytes are the version's. Else removes it, so
  /// that others find room on the disk: the error of the fetch, or DataLoss.
  [[nodiscard]] absl::Status Keep(const catalogue::Version& version,
                                  const absl::Status& fetched) const;
  void Remove(const catalogue::Version& version) const;
  /// Of all files in it.
  [[nodiscard]] std::int64_t NumBytes() const;

  /// What is in force, for the next start without the catalogue.
  [[nodiscard]] absl::Status RememberLive(const std::vector<catalogue::Version>& live) const;
  [[nodiscard]] absl::StatusOr<std::vector<catalogue::Version>> RecallLive() const;
  /// Removes the files of versions that are not among these.
  void RemoveAllBut(const std::vector<catalogue::Version>& versions) const;

 private:
  MapCacheDir(std::string folder, FileDescriptor lock)
      : folder_(std::move(folder)), lock_(std::move(lock)) {}

  std::string folder_;
  FileDescriptor lock_;
};

}  // namespace scanloc::server

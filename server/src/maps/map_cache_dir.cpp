#include "maps/map_cache_dir.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "maps/map_sources.hpp"
#include "scanloc/catalogue/store.hpp"
#include "scanloc/catalogue/version_file.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

namespace fs = std::filesystem;

constexpr char kPart[] = ".part";
/// How a map fares in use, beside it.
constexpr char kHealth[] = ".health";
constexpr char kOld[] = ".old";
constexpr char kRemembered[] = "/live.json";

template <typename Act>
void ForEachFile(const std::string& folder, Act&& act) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    act(entry->path());
  }
}

}  // namespace

absl::StatusOr<MapCacheDir> MapCacheDir::Open(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  const std::string lock_path = absl::StrCat(folder, "/lock");
  FileDescriptor lock(open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (lock.get() < 0) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot write into the cache folder '", folder, "': ", std::strerror(errno)));
  }
  if (flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    return absl::AlreadyExistsError(
        absl::StrCat("the cache folder '", folder, "' is another server's; give each its own"));
  }
  MapCacheDir opened(folder, std::move(lock));
  ForEachFile(folder, [](const fs::path& path) {
    std::error_code ignored;  // what stays is looked at, and overwritten, later
    if (path.extension() == kPart) fs::remove(path, ignored);
  });
  return opened;
}

std::string MapCacheDir::PathOf(const catalogue::Version& version) const {
  return absl::StrCat(folder_, "/", version.FileName());
}

std::string MapCacheDir::PartOf(const catalogue::Version& version) const {
  return absl::StrCat(PathOf(version), kPart);
}

bool MapCacheDir::Has(const catalogue::Version& version) const {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(PathOf(version), error);
  return !error && static_cast<std::int64_t>(size) == version.num_bytes;
}

absl::Status MapCacheDir::Keep(const catalogue::Version& version,
                               const absl::Status& fetched) const {
  const std::string part = PartOf(version);
  if (!fetched.ok()) {
    unlink(part.c_str());
    return fetched;
  }
  ASSIGN_OR_RETURN(const std::string sha256, catalogue::Sha256OfFile(part));
  if (sha256 != version.sha256) {
    unlink(part.c_str());
    return absl::DataLossError(absl::StrCat("what the store has as ", version.FileName(),
                                            " is not what was published: its hash is ", sha256,
                                            ", not ", version.sha256));
  }
  if (rename(part.c_str(), PathOf(version).c_str()) == 0) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot rename '", part, "': ", std::strerror(errno)));
}

void MapCacheDir::Remove(const catalogue::Version& version) const {
  const std::string path = PathOf(version);
  for (const std::string& file : {path, path + kHealth, path + kHealth + kOld}) {
    unlink(file.c_str());
  }
}

std::int64_t MapCacheDir::NumBytes() const {
  std::int64_t sum = 0;
  ForEachFile(folder_, [&](const fs::path& path) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(path, error);
    if (!error) sum += static_cast<std::int64_t>(size);
  });
  return sum;
}

absl::Status MapCacheDir::RememberLive(const std::vector<catalogue::Version>& live) const {
  return catalogue::WriteVersions(absl::StrCat(folder_, kRemembered), live);
}

absl::StatusOr<std::vector<catalogue::Version>> MapCacheDir::RecallLive() const {
  return catalogue::ReadVersions(absl::StrCat(folder_, kRemembered));
}

void MapCacheDir::RemoveAllBut(const std::vector<catalogue::Version>& versions) const {
  std::set<std::string> kept;
  for (const catalogue::Version& version : versions) kept.insert(version.FileName());
  ForEachFile(folder_, [&](const fs::path& path) {
    std::error_code ignored;  // it counts as room that is taken
    fs::path map = path;
    if (map.extension() == kOld) map.replace_extension();
    if (map.extension() == kHealth) map.replace_extension();
    if (map.extension() == kMapEnding && !kept.contains(map.filename().string())) {
      fs::remove(path, ignored);
    }
  });
}

}  // namespace scanloc::server

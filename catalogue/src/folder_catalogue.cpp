#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "kinds.hpp"
#include "scanloc/catalogue/catalogue.hpp"
#include "scanloc/catalogue/version_file.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::catalogue {
namespace {

constexpr std::int64_t kMaxFileBytes = 64 << 20;

/// Writes a file in one step: it has all of the text or is as it was. ResourceExhausted.
absl::Status WriteTextFile(const std::string& path, const std::string& text) {
  const std::string next = absl::StrCat(path, ".next");
  const FileDescriptor file(open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  const bool is_written = file.get() >= 0 && WriteAll(file, text) && fsync(file.get()) == 0 &&
                          rename(next.c_str(), path.c_str()) == 0;
  const int why = errno;
  if (is_written) return absl::OkStatus();
  unlink(next.c_str());
  return absl::ResourceExhaustedError(
      absl::StrCat("cannot write '", path, "': ", std::strerror(why), "; it is as it was"));
}

/// Empty where there is no file. Unavailable: it cannot be read, or has more than 64 MiB.
absl::StatusOr<std::string> ReadTextFile(const std::string& path) {
  absl::StatusOr<std::string> text = ReadFile(path, kMaxFileBytes);
  if (absl::IsNotFound(text.status())) return std::string();
  return text.ok() ? std::move(text) : absl::UnavailableError(text.status().message());
}

/// Those of before polygons have a box of the map frame.
Area AreaOf(const nlohmann::json& json) {
  Area area{.corners = {}, .is_on_earth = json.value("on_earth", false)};
  if (!json.contains("corners")) {
    const nlohmann::json& box = json.at("area");
    area.corners = CornersOf({box.at(0), box.at(1), box.at(2), box.at(3)});
  } else {
    for (const nlohmann::json& corner : json.at("corners")) {
      area.corners.push_back({corner.at(0), corner.at(1)});
    }
  }
  return area;
}

nlohmann::json ToJson(const Version& version) {
  // Programs that know of no polygons read the box.
  const Box box = BoxOf(version.area);
  nlohmann::json corners = nlohmann::json::array();
  for (const Corner& corner : version.area.corners) corners.push_back({corner.x, corner.y});
  return {{"region", version.region},
          {"content_id", version.content_id},
          {"sha256", version.sha256},
          {"num_bytes", version.num_bytes},
          {"num_places", version.num_places},
          {"area", {box.min_x, box.min_y, box.max_x, box.max_y}},
          {"corners", std::move(corners)},
          {"on_earth", version.area.is_on_earth},
          {"published_by", version.published_by},
          {"published_ms", version.published_ms}};
}

/// DataLoss: it is none.
absl::StatusOr<Version> FromJson(const nlohmann::json& json) {
  try {
    Version version;
    json.at("region").get_to(version.region);
    json.at("content_id").get_to(version.content_id);
    json.at("sha256").get_to(version.sha256);
    json.at("num_bytes").get_to(version.num_bytes);
    json.at("num_places").get_to(version.num_places);
    json.at("published_by").get_to(version.published_by);
    json.at("published_ms").get_to(version.published_ms);
    version.area = AreaOf(json);
    if (absl::Status status = Validate(version); !status.ok()) {
      return absl::DataLossError(status.message());
    }
    return version;
  } catch (const nlohmann::json::exception& error) {
    return absl::DataLossError(absl::StrCat("it holds no version of a map: ", error.what()));
  }
}

constexpr std::chrono::milliseconds kLook(200);

/// All that the file says.
struct Content {
  std::vector<Version> versions;            // in the order published
  std::map<std::string, std::size_t> live;  // by region, an index of versions
};

absl::StatusOr<Content> Parse(const std::string& text, const std::string& path) {
  Content content;
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const auto damaged = [&](absl::string_view why) {
    return absl::DataLossError(
        absl::StrCat("the catalogue '", path, "' is damaged: ", why,
                     "; restore it from a copy, or publish anew without it"));
  };
  if (!json.is_object() || !json.contains("versions") || !json.contains("live") ||
      !json["versions"].is_array() || !json["live"].is_object()) {
    return damaged("it is no JSON of a catalogue");
  }
  for (const nlohmann::json& entry : json["versions"]) {
    absl::StatusOr<Version> version = FromJson(entry);
    if (!version.ok()) return damaged(version.status().message());
    content.versions.push_back(*std::move(version));
  }
  for (const auto& [region, number] : json["live"].items()) {
    if (!number.is_number_unsigned() || number.get<std::size_t>() >= content.versions.size() ||
        content.versions[number.get<std::size_t>()].region != region) {
      return damaged(absl::StrCat("what is in force for ", region, " is none of its versions"));
    }
    content.live[region] = number.get<std::size_t>();
  }
  return content;
}

class FolderCatalogue : public Catalogue {
 public:
  explicit FolderCatalogue(std::string folder)
      : path_(absl::StrCat(folder, "/catalogue.json")), lock_path_(absl::StrCat(folder, "/lock")) {}

  absl::Status Publish(const Version& version) override {
    RETURN_IF_ERROR(Validate(version));
    return Change([&](Content& content) {
      content.versions.push_back(version);
      content.versions.back().published_ms =
          std::chrono::duration_cast<std::chrono::milliseconds>(
              std::chrono::system_clock::now().time_since_epoch())
              .count();
      content.live[version.region] = content.versions.size() - 1;
      return absl::OkStatus();
    });
  }

  absl::StatusOr<Version> Rollback(const std::string& region,
                                   const std::string& content_id) override {
    Version found;
    const absl::Status status = Change([&](Content& content) -> absl::Status {
      const auto live = content.live.find(region);
      const bool may_be_any = !content_id.empty();
      for (std::size_t i = content.versions.size(); i-- > 0;) {
        const Version& version = content.versions[i];
        const bool is_before = live != content.live.end() && i < live->second &&
                               version.sha256 != content.versions[live->second].sha256;
        if (version.region != region) continue;
        if (may_be_any ? version.content_id != content_id : !is_before) continue;
        content.live[region] = i;
        found = version;
        return absl::OkStatus();
      }
      return absl::NotFoundError(absl::StrCat("region ", region, " has no version ",
                                              may_be_any ? content_id : "before the one in force",
                                              "; scanloc catalogue tells which it has"));
    });
    if (!status.ok()) return status;
    return found;
  }

  absl::Status Withdraw(const std::string& region) override {
    return Change([&](Content& content) {
      return content.live.erase(region) > 0
                 ? absl::OkStatus()
                 : absl::NotFoundError(absl::StrCat("no map of region ", region, " is in force"));
    });
  }

  absl::StatusOr<std::vector<Version>> Live() override {
    ASSIGN_OR_RETURN(const Content content, Read());
    std::vector<Version> live;
    for (const auto& [region, number] : content.live) live.push_back(content.versions[number]);
    return live;
  }

  absl::StatusOr<std::vector<Version>> History(const std::string& region) override {
    ASSIGN_OR_RETURN(Content content, Read());
    std::vector<Version> history;
    for (auto version = content.versions.rbegin(); version != content.versions.rend(); ++version) {
      if (version->region == region) history.push_back(*version);
    }
    return history;
  }

  absl::Status AwaitChange(std::chrono::milliseconds longest) override {
    const auto end = std::chrono::steady_clock::now() + longest;
    while (std::chrono::steady_clock::now() < end) {
      struct stat now = {};
      if (stat(path_.c_str(), &now) == 0 && now.st_ino != std::exchange(inode_, now.st_ino)) {
        return absl::OkStatus();
      }
      std::this_thread::sleep_for(std::min(longest, kLook));
    }
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<Content> Read() const {
    ASSIGN_OR_RETURN(const std::string text, ReadTextFile(path_));
    return text.empty() ? Content() : Parse(text, path_);
  }

  template <typename Edit>
  absl::Status Change(Edit&& edit) const {
    const FileDescriptor lock(open(lock_path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
    if (lock.get() < 0 || flock(lock.get(), LOCK_EX) != 0) {
      return absl::UnavailableError(
          absl::StrCat("cannot lock the catalogue '", path_, "': ", std::strerror(errno)));
    }
    absl::StatusOr<Content> content = Read();
    absl::Status status = content.status();
    if (status.ok()) status = edit(*content);
    return status.ok() ? Write(*content) : status;
  }

  absl::Status Write(const Content& content) const {
    nlohmann::json json = {{"versions", nlohmann::json::array()},
                           {"live", nlohmann::json::object()}};
    for (const Version& version : content.versions) json["versions"].push_back(ToJson(version));
    for (const auto& [region, number] : content.live) json["live"][region] = number;
    return WriteTextFile(path_, json.dump(1));
  }

  std::string path_;
  std::string lock_path_;
  ino_t inode_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Catalogue>> OpenFolderCatalogue(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot make the catalogue's folder '", folder, "': ", error.message()));
  }
  return std::make_unique<FolderCatalogue>(folder);
}

absl::Status WriteVersions(const std::string& path, const std::vector<Version>& versions) {
  nlohmann::json json = nlohmann::json::array();
  for (const Version& version : versions) json.push_back(ToJson(version));
  return WriteTextFile(path, json.dump(1));
}

absl::StatusOr<std::vector<Version>> ReadVersions(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadTextFile(path));
  std::vector<Version> versions;
  if (text.empty()) return versions;
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_array()) return absl::DataLossError(absl::StrCat("'", path, "' holds no versions"));
  for (const nlohmann::json& entry : json) {
    ASSIGN_OR_RETURN(Version version, FromJson(entry));
    versions.push_back(std::move(version));
  }
  return versions;
}

}  // namespace scanloc::catalogue

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "kinds.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "text_file.hpp"
#include "version_json.hpp"

namespace scanloc::catalogue {
namespace {

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

}  // namespace scanloc::catalogue

#include "page_files.hpp"

#include <array>
#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "api.hpp"
#include "json.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::web {
namespace {

constexpr std::array<std::pair<const char*, const char*>, 3> kFiles = {
    {{"index.html", "text/html; charset=utf-8"},
     {"page.js", "text/javascript; charset=utf-8"},
     {"page.css", "text/css; charset=utf-8"}}};
constexpr const char* kStyle = "<link rel=\"stylesheet\" href=\"page.css\">";
constexpr const char* kScript = "<script type=\"module\" src=\"page.js\"></script>";
constexpr const char* kNoSnapshot =
    "<script id=\"snapshot\" type=\"application/json\">null</script>";

/// Places whose contexts a snapshot holds: those that its answers name first.
constexpr std::size_t kMaxPlacesHeld = 400;

/// Asks the interface and keeps what it says.
class Recorder {
 public:
  Recorder(const Api& api, std::string token) : api_(api), token_(std::move(token)) {}

  absl::StatusOr<Json> Record(const std::string& path) {
    const Response response = api_.Handle({.method = "GET", .path = path, .token = token_});
    if (response.status != 200) {
      return absl::UnavailableError(absl::StrCat(path, ": ", response.body));
    }
    if (response.content_type != "application/json") {
      responses_[path] = {{"base64", absl::Base64Escape(response.body)}};
      return Json();
    }
    Json json = Json::parse(response.body);
    responses_[path] = {{"json", json}};
    return json;
  }

  /// Answers of all pages, as one.
  Json RecordAnswers() {
    Json all{{"run", ""}, {"next_after", 0}, {"answers", Json::array()}};
    while (true) {
      const Response response = api_.Handle(
          {.method = "GET",
           .path = "/v1/answers",
           .parameters = {{"run", all["run"]},
                          {"after", absl::StrCat(all["next_after"].get<std::uint64_t>())}},
           .token = token_});
      if (response.status != 200) break;  // a server may keep none
      const Json page = Json::parse(response.body);
      if (page["answers"].empty()) break;
      for (const Json& answer : page["answers"]) all["answers"].push_back(answer);
      all["run"] = page["run"];
      all["next_after"] = page["next_after"];
    }
    responses_["/v1/answers"] = {{"json", all}};
    return all;
  }

  [[nodiscard]] const Json& responses() const { return responses_; }

 private:
  const Api& api_;
  const std::string token_;
  Json responses_ = Json::object();
};

}  // namespace

absl::StatusOr<PageFiles> PageFiles::Open(const std::string& folder) {
  PageFiles page;
  for (const auto& [name, type] : kFiles) {
    constexpr std::int64_t kMostBytes = 64 << 20;
    absl::StatusOr<std::string> text = ReadFile(absl::StrCat(folder, "/", name), kMostBytes);
    if (!text.ok()) {
      return absl::NotFoundError(absl::StrCat("there is no page: ", text.status().message(),
                                              "; build it (npm is needed)"));
    }
    page.files_[name] = *std::move(text);
  }
  return page;
}

std::string PageFiles::DefaultFolder() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto beside = program.parent_path().parent_path();
  for (const char* folder : {"share/scanloc/page", "web/page"}) {
    if (std::filesystem::exists(beside / folder / "index.html", error)) return beside / folder;
  }
  return beside / "share/scanloc/page";
}

std::optional<Response> PageFiles::Serve(const Request& request) const {
  if (request.method != "GET" && request.method != "HEAD") return std::nullopt;
  const std::string name = request.path == "/" ? "index.html" : request.path.substr(1);
  for (const auto& [file, type] : kFiles) {
    if (name != file) continue;
    return Response{
        .content_type = type, .body = files_.at(name), .headers = {{"Cache-Control", "no-cache"}}};
  }
  return std::nullopt;
}

absl::StatusOr<std::string> PageFiles::Snapshot(const Api& api, const std::string& map,
                                                const std::string& token) const {
  Recorder recorder(api, token);
  const std::string base = absl::StrCat("/v1/maps/", map);
  for (const std::string& path : {base, base + "/pairs"}) {
    RETURN_IF_ERROR(recorder.Record(path).status());
  }
  ASSIGN_OR_RETURN(const auto tiles, recorder.Record(base + "/tiles"));
  for (std::size_t i = 0; i < tiles["tiles"].size(); ++i) {
    RETURN_IF_ERROR(recorder.Record(absl::StrCat(base, "/tiles/", i)).status());
  }
  const Json answers = recorder.RecordAnswers();
  std::set<std::int64_t> places;
  for (const Json& answer : answers["answers"]) {
    if (answer["answer"]["map"] != map) continue;
    for (const Json& candidate : answer["answer"]["candidates"]) {
      if (places.size() < kMaxPlacesHeld) places.insert(candidate["place"].get<std::int64_t>());
    }
  }
  for (const std::int64_t place : places) {
    RETURN_IF_ERROR(recorder.Record(absl::StrCat(base, "/places/", place)).status());
  }
  // No "<" in what is embedded: nothing in it ends the element that it stands in.
  const std::string data = absl::StrReplaceAll(
      ToLine({{"map", map}, {"responses", recorder.responses()}}), {{"<", "\\u003c"}});
  return absl::StrReplaceAll(
      files_.at("index.html"),
      {{kStyle, absl::StrCat("<style>", files_.at("page.css"), "</style>")},
       {kNoSnapshot,
        absl::StrCat("<script id=\"snapshot\" type=\"application/json\">", data, "</script>")},
       {kScript,
        absl::StrCat("<script type=\"module\">",
                     absl::StrReplaceAll(files_.at("page.js"), {{"</script", "<\\/script"}}),
                     "</script>")}});
}

}  // namespace scanloc::web

#include <curl/curl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "kinds.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::catalogue {
namespace {

constexpr long kHttpOk = 200;
constexpr long kHttpCreated = 201;
constexpr long kHttpNoContent = 204;
constexpr long kHttpNotFound = 404;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

struct EndCurl {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

/// Where files are, and how requests are signed.
struct Place {
  std::string base_url;   // with a slash at its end
  std::string signature;  // of S3, as libcurl wants it; else empty
  std::string key_id, secret;
};

/// What S3 wants to be told of a request without a body.
constexpr const char* kSha256OfNothing =
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

struct Request {
  std::unique_ptr<CURL, EndCurl> curl;
  std::unique_ptr<curl_slist, EndCurl> headers;
};

/// One download: how much may come, and what went wrong with the file that it is written to.
struct Download {
  File file;
  std::int64_t bytes_left = 0;
  bool is_too_long = false;
  int error = 0;
  const std::function<bool()>* go_on = nullptr;
};

std::size_t Take(char* data, std::size_t size, std::size_t count, void* to) {
  auto& download = *static_cast<Download*>(to);
  const std::size_t bytes = size * count;
  download.bytes_left -= static_cast<std::int64_t>(bytes);
  download.is_too_long = download.bytes_left < 0;
  if (download.is_too_long) return 0;
  errno = 0;
  if (std::fwrite(data, 1, bytes, download.file.get()) == bytes) return bytes;
  download.error = errno == 0 ? ENOSPC : errno;
  return 0;
}

int AskWhetherToGoOn(void* download, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return (*static_cast<Download*>(download)->go_on)() ? 0 : 1;
}

std::size_t Drop(char*, std::size_t size, std::size_t count, void*) { return size * count; }

class HttpStore : public Store {
 public:
  HttpStore(Place place, const StoreOptions& options)
      : place_(std::move(place)), options_(options) {}

  absl::Status Put(const std::string& name, const std::string& path) override {
    File file(std::fopen(path.c_str(), "rbe"));
    std::error_code error;
    const auto size = static_cast<curl_off_t>(std::filesystem::file_size(path, error));
    if (file == nullptr || error) return absl::NotFoundError(absl::StrCat("cannot read ", path));
    if (Has(name, path)) return absl::OkStatus();
    std::string sha256;
    if (!place_.signature.empty()) {
      ASSIGN_OR_RETURN(sha256, Sha256OfFile(path));
    }
    const auto [curl, headers] = Begin(name, sha256);
    if (curl == nullptr) return absl::ResourceExhaustedError("out of memory");
    curl_easy_setopt(curl.get(), CURLOPT_UPLOAD, 1L);
    curl_easy_setopt(curl.get(), CURLOPT_READDATA, file.get());
    curl_easy_setopt(curl.get(), CURLOPT_INFILESIZE_LARGE, size);
    curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, Drop);
    return StatusOf(curl_easy_perform(curl.get()), curl.get(), "put", name);
  }

  absl::Status Get(const std::string& name, const std::string& path, std::int64_t max_bytes,
                   const std::function<bool()>& go_on) override {
    Download download{
        .file = File(std::fopen(path.c_str(), "wbe")), .bytes_left = max_bytes, .go_on = &go_on};
    if (download.file == nullptr) return WriteError(path, errno);
    const auto [curl, headers] = Begin(name, kSha256OfNothing);
    if (curl == nullptr) return absl::ResourceExhaustedError("out of memory");
    curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, Take);
    curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &download);
    curl_easy_setopt(curl.get(), CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl.get(), CURLOPT_XFERINFOFUNCTION, AskWhetherToGoOn);
    curl_easy_setopt(curl.get(), CURLOPT_XFERINFODATA, &download);
    const CURLcode code = curl_easy_perform(curl.get());
    if (download.error != 0) return WriteError(path, download.error);
    if (download.is_too_long) {
      return absl::DataLossError(absl::StrCat("the store gives more than the ", max_bytes,
                                              " bytes that ", name, " should have"));
    }
    if (code == CURLE_ABORTED_BY_CALLBACK) {
      return absl::CancelledError("the transfer was stopped");
    }
    RETURN_IF_ERROR(StatusOf(code, curl.get(), "get", name));
    const bool is_durable =
        std::fflush(download.file.get()) == 0 && fsync(fileno(download.file.get())) == 0;
    return is_durable ? absl::OkStatus() : WriteError(path, errno);
  }

 private:
  /// Whether the store shows by its ETag that it has the very file.
  [[nodiscard]] bool Has(const std::string& name, const std::string& path) const {
    const auto [curl, headers] = Begin(name, kSha256OfNothing);
    if (curl == nullptr) return false;
    curl_easy_setopt(curl.get(), CURLOPT_NOBODY, 1L);
    long answer = 0;
    curl_header* tag = nullptr;
    if (curl_easy_perform(curl.get()) != CURLE_OK ||
        curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer) != CURLE_OK ||
        answer != kHttpOk ||
        curl_easy_header(curl.get(), "ETag", 0, CURLH_HEADER, -1, &tag) != CURLHE_OK) {
      return false;
    }
    // Another kind of tag is not worth reading the file for.
    constexpr std::size_t kSizeOfMd5 = 34;  // 32 digits in quotation marks
    if (std::string_view(tag->value).size() != kSizeOfMd5) return false;
    const absl::StatusOr<std::string> md5 = Md5OfFile(path);
    return md5.ok() && absl::StrCat("\"", *md5, "\"") == tag->value;
  }

  static absl::Status WriteError(const std::string& path, int error) {
    const std::string text = absl::StrCat("cannot write '", path, "': ", std::strerror(error));
    return error == ENOSPC || error == EDQUOT || error == EFBIG
               ? absl::ResourceExhaustedError(absl::StrCat(text, "; make room on the disk"))
               : absl::UnavailableError(text);
  }

  /// Signed, if it is, with the hash of its body.
  [[nodiscard]] Request Begin(const std::string& name, const std::string& sha256) const {
    Request request{std::unique_ptr<CURL, EndCurl>(curl_easy_init()), nullptr};
    const auto& curl = request.curl;
    if (curl == nullptr) return request;
    curl_easy_setopt(curl.get(), CURLOPT_URL, absl::StrCat(place_.base_url, name).c_str());
    curl_easy_setopt(curl.get(), CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl.get(), CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl.get(), CURLOPT_FAILONERROR, 1L);
    curl_easy_setopt(curl.get(), CURLOPT_CONNECTTIMEOUT_MS,
                     static_cast<long>(1e3 * options_.connect_s));
    curl_easy_setopt(curl.get(), CURLOPT_LOW_SPEED_LIMIT,
                     static_cast<long>(options_.least_bytes_per_s));
    curl_easy_setopt(curl.get(), CURLOPT_LOW_SPEED_TIME, static_cast<long>(options_.slow_s));
    if (!place_.signature.empty()) {
      curl_easy_setopt(curl.get(), CURLOPT_AWS_SIGV4, place_.signature.c_str());
      curl_easy_setopt(curl.get(), CURLOPT_USERNAME, place_.key_id.c_str());
      curl_easy_setopt(curl.get(), CURLOPT_PASSWORD, place_.secret.c_str());
      request.headers.reset(
          curl_slist_append(nullptr, absl::StrCat("x-amz-content-sha256: ", sha256).c_str()));
      curl_easy_setopt(curl.get(), CURLOPT_HTTPHEADER, request.headers.get());
    }
    return request;
  }

  [[nodiscard]] absl::Status StatusOf(CURLcode code, CURL* curl, absl::string_view what,
                                      const std::string& name) const {
    long answer = 0;
    curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &answer);
    const bool is_stored = what == "put" && (answer == kHttpCreated || answer == kHttpNoContent);
    if (code == CURLE_OK && (answer == kHttpOk || is_stored)) return absl::OkStatus();
    // A redirect, a part, a promise: libcurl takes it for an answer like others.
    const char* const why =
        code == CURLE_OK ? "another answer than a store's" : curl_easy_strerror(code);
    const std::string text = absl::StrCat("cannot ", what, " ", place_.base_url, name, ": ", why);
    if (answer == kHttpNotFound) return absl::NotFoundError(text);
    if (code == CURLE_PARTIAL_FILE) return absl::UnavailableError(text);
    return absl::UnavailableError(answer > 0 ? absl::StrCat(text, " (status ", answer, ")") : text);
  }

  const Place place_;
  const StoreOptions options_;
};

std::string WithSlash(std::string url) {
  if (!url.ends_with('/')) url += '/';
  return url;
}

absl::StatusOr<Place> ParseS3(absl::string_view url) {
  const std::pair<absl::string_view, absl::string_view> parts =
      absl::StrSplit(absl::StripPrefix(url, "s3://"), absl::MaxSplits('?', 1));
  std::map<std::string, std::string> options = absl::StrSplit(parts.second, absl::ByAnyChar("=&"));
  options.erase("");
  const std::string region = options.contains("region") ? options["region"] : "us-east-1";
  const std::string endpoint = options.contains("endpoint")
                                   ? options["endpoint"]
                                   : absl::StrCat("https://s3.", region, ".amazonaws.com");
  const char* id = std::getenv("AWS_ACCESS_KEY_ID");
  const char* secret = std::getenv("AWS_SECRET_ACCESS_KEY");
  if (parts.first.empty() || id == nullptr || secret == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("the store '", url,
                                                   "' needs a bucket, and $AWS_ACCESS_KEY_ID and ",
                                                   "$AWS_SECRET_ACCESS_KEY in the environment"));
  }
  return Place{.base_url = WithSlash(absl::StrCat(WithSlash(endpoint), parts.first)),
               .signature = absl::StrCat("aws:amz:", region, ":s3"),
               .key_id = id,
               .secret = secret};
}

}  // namespace

absl::StatusOr<std::unique_ptr<Store>> OpenHttpStore(const std::string& url,
                                                     const StoreOptions& options) {
  static const CURLcode kStarted = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (kStarted != CURLE_OK) return absl::ResourceExhaustedError("libcurl cannot be started");
  absl::StatusOr<Place> place = Place{.base_url = WithSlash(url)};
  if (absl::StartsWith(url, "s3://")) place = ParseS3(url);
  if (!place.ok()) return place.status();
  return std::make_unique<HttpStore>(*std::move(place), options);
}

}  // namespace scanloc::catalogue

#include "access.hpp"

#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"

namespace scanloc::server {
namespace {

constexpr std::size_t kMinTokenBytes = 16;
constexpr std::size_t kMaxTokenBytes = 512;
constexpr std::size_t kMaxTokens = 10'000;
constexpr std::chrono::seconds kLookInterval(1);
constexpr std::string_view kScheme = "Bearer ";

absl::Status NoToken(const char* what) {
  return absl::UnauthenticatedError(
      absl::StrCat(what, "; send the metadata \"authorization: Bearer TOKEN\""));
}

}  // namespace

Access::Digest Access::DigestOf(std::string_view token) {
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), digest.data());
  return digest;
}

Access::FileStamp Access::StampOf(const std::string& path) {
  struct stat status = {};
  if (stat(path.c_str(), &status) != 0) return {};
  return {.inode = static_cast<std::int64_t>(status.st_ino),
          .changed_ns = status.st_mtim.tv_sec * 1'000'000'000 + status.st_mtim.tv_nsec,
          .num_bytes = status.st_size};
}

absl::StatusOr<Access::Token> Access::ParseLine(const std::string& line) {
  std::istringstream words(line);
  Token token;
  std::string role;
  std::string secret;
  std::string more;
  words >> token.name >> role >> secret;
  if (secret.empty() || words >> more) {
    return absl::InvalidArgumentError("is not NAME ROLE TOKEN");
  }
  if (role == "admin") {
    token.role = Role::kAdmin;
  } else if (role != "query") {
    return absl::InvalidArgumentError("has a role that is neither query nor admin");
  }
  const bool is_printable = std::all_of(secret.begin(), secret.end(),
                                        [](unsigned char c) { return std::isgraph(c) != 0; });
  if (secret.size() < kMinTokenBytes || secret.size() > kMaxTokenBytes || !is_printable) {
    return absl::InvalidArgumentError(absl::StrCat("has a token that is not ", kMinTokenBytes,
                                                   " to ", kMaxTokenBytes,
                                                   " printable characters"));
  }
  token.digest = DigestOf(secret);
  return token;
}

absl::StatusOr<Access::Tokens> Access::Read(const std::string& path) {
  std::ifstream file(path);
  if (!file) return absl::NotFoundError(absl::StrCat("cannot read token file ", path));
  Tokens tokens;
  std::set<Digest> digests;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos || line[begin] == '#') continue;
    const auto token = ParseLine(line);
    absl::Status status = token.status();
    if (status.ok() && !digests.insert(token->digest).second) {
      status = absl::InvalidArgumentError("has a token that another line has, too");
    }
    if (status.ok() && tokens.size() == kMaxTokens) {
      status = absl::InvalidArgumentError(absl::StrCat("is beyond ", kMaxTokens, " tokens"));
    }
    if (!status.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat("line ", number, " of token file ", path, " ", status.message()));
    }
    tokens.push_back(*token);
  }
  if (file.bad()) return absl::DataLossError(absl::StrCat("cannot read token file ", path));
  return tokens;
}

absl::StatusOr<std::unique_ptr<Access>> Access::Create(const std::string& token_file) {
  auto access = std::unique_ptr<Access>(new Access(token_file));
  if (token_file.empty()) return access;
  access->stamp_ = StampOf(token_file);
  auto tokens = Read(token_file);
  if (!tokens.ok()) return tokens.status();
  access->tokens_ = std::make_shared<const Tokens>(*std::move(tokens));
  return access;
}

void Access::LookAtFile() {
  const std::unique_lock look(look_mutex_, std::try_to_lock);
  if (!look) return;  // another call is at it
  const auto now = std::chrono::steady_clock::now();
  if (now < next_look_) return;
  next_look_ = now + kLookInterval;
  const FileStamp stamp = StampOf(token_file_);
  if (stamp == stamp_) return;
  stamp_ = stamp;
  auto tokens = Read(token_file_);
  if (!tokens.ok()) {
    return spdlog::error("the tokens before stay in force: {}",
                         absl::StrCat(tokens.status().message()));
  }
  spdlog::info("token file {} read again: {} tokens", token_file_, tokens->size());
  auto next = std::make_shared<const Tokens>(*std::move(tokens));
  const std::lock_guard lock(mutex_);
  tokens_.swap(next);
}

std::shared_ptr<const Access::Tokens> Access::Current() {
  LookAtFile();
  const std::lock_guard lock(mutex_);
  return tokens_;
}

absl::StatusOr<std::string> Access::Look(const Digest& digest, Role role) {
  const std::shared_ptr<const Tokens> tokens = Current();
  // Every token is compared to its last byte, so that the time taken tells nothing.
  const Token* found = nullptr;
  for (const Token& token : *tokens) {
    if (CRYPTO_memcmp(token.digest.data(), digest.data(), digest.size()) == 0) found = &token;
  }
  if (found == nullptr) return NoToken("the token is not known here");
  if (found->role < role) {
    return absl::PermissionDeniedError(
        absl::StrCat("the token of ", found->name, " does not allow administration"));
  }
  return found->name;
}

absl::StatusOr<Caller> Access::Admit(const grpc::CallbackServerContext& context, Role role) {
  if (token_file_.empty()) {
    if (role == Role::kQuery) return Caller();
    return absl::PermissionDeniedError("administration needs a server with a token file");
  }
  const auto& metadata = context.client_metadata();
  const auto header = metadata.find("authorization");
  if (header == metadata.end()) return NoToken("the call carries no token");
  const std::string_view value(header->second.data(), header->second.size());
  if (value.substr(0, kScheme.size()) != kScheme) return NoToken("the call carries no token");
  const Digest digest = DigestOf(value.substr(kScheme.size()));
  auto name = Look(digest, role);
  if (!name.ok()) return name.status();
  return Caller{.name = *std::move(name),
                .digest = std::string(reinterpret_cast<const char*>(digest.data()), digest.size())};
}

absl::Status Access::AdmitAgain(const Caller& caller, Role role) {
  if (token_file_.empty()) return absl::OkStatus();
  Digest digest;
  std::memcpy(digest.data(), caller.digest.data(), digest.size());
  return Look(digest, role).status();
}

}  // namespace scanloc::server

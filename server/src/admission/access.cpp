#include "admission/access.hpp"

#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <set>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::server {
namespace {

constexpr std::size_t kMinTokenBytes = 16;
constexpr std::size_t kMaxTokenBytes = 512;
constexpr std::size_t kMaxTokens = 10'000;
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
  } else if (role == "view") {
    token.role = Role::kView;
  } else if (role != "query") {
    return absl::InvalidArgumentError("has a role that is none of query, view and admin");
  }
  const bool is_printable =
      std::ranges::all_of(secret, [](unsigned char c) { return std::isgraph(c) != 0; });
  if (secret.size() < kMinTokenBytes || secret.size() > kMaxTokenBytes || !is_printable) {
    return absl::InvalidArgumentError(absl::StrCat("has a token that is not ", kMinTokenBytes,
                                                   " to ", kMaxTokenBytes,
                                                   " printable characters"));
  }
  token.digest = DigestOf(secret);
  return token;
}

absl::StatusOr<Access::Tokens> Access::Parse(const std::string& text) {
  std::istringstream file(text);
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
          absl::StrCat("line ", number, " of the token file ", status.message()));
    }
    tokens.push_back(*token);
  }
  return tokens;
}

Access::Access(const std::string& token_file)
    : token_file_(token_file),
      watch_({.name = "tokens",
              .paths = {token_file},
              .take_up = [this](const FileWatch::Texts& texts) { return TakeUp(texts.front()); }}) {
}

absl::StatusOr<std::unique_ptr<Access>> Access::Create(const std::string& token_file) {
  auto access = std::unique_ptr<Access>(new Access(token_file));
  if (token_file.empty()) return access;
  if (auto status = access->LookAtFile(); !status.ok()) {
    return absl::Status(status.code(), absl::StrCat("token file: ", status.message()));
  }
  return access;
}

void Access::StartWatching(FileWatch::Tell tell) {
  if (!token_file_.empty()) watch_.Start(std::move(tell));
}

void Access::StopWatching() { watch_.Stop(); }

absl::Status Access::TakeUp(const std::string& text) {
  ASSIGN_OR_RETURN(auto tokens, Parse(text));
  auto next = std::make_shared<const Tokens>(std::move(tokens));
  spdlog::info("token file read: {} tokens", next->size());
  const std::lock_guard lock(mutex_);
  tokens_.swap(next);
  return absl::OkStatus();
}

absl::StatusOr<std::string> Access::Look(const Digest& digest, Role role) {
  if (watch_.UnknownFor() > kMaxUnknown) {
    return absl::UnavailableError(
        "the server has not been able to use its token file for some minutes, and so does not know "
        "who may call; its log says why");
  }
  std::shared_ptr<const Tokens> tokens;
  {
    const std::lock_guard lock(mutex_);
    tokens = tokens_;
  }
  // Every token is compared to its last byte, so that the time taken tells nothing.
  const Token* found = nullptr;
  for (const Token& token : *tokens) {
    if (CRYPTO_memcmp(token.digest.data(), digest.data(), digest.size()) == 0) found = &token;
  }
  if (found == nullptr) return NoToken("the token is not known here");
  if (found->role < role) {
    return absl::PermissionDeniedError(
        absl::StrCat("the token of ", found->name, " does not allow ",
                     role == Role::kAdmin ? "administration" : "to see what others are told"));
  }
  return found->name;
}

absl::StatusOr<Caller> Access::Admit(const grpc::CallbackServerContext& context, Role role) {
  if (token_file_.empty()) {
    if (role != Role::kAdmin) return Caller();
    return absl::PermissionDeniedError("administration needs a server with a token file");
  }
  const auto& metadata = context.client_metadata();
  const auto header = metadata.find("authorization");
  if (header == metadata.end()) return NoToken("the call carries no token");
  const std::string_view value(header->second.data(), header->second.size());
  if (value.substr(0, kScheme.size()) != kScheme) return NoToken("the call carries no token");
  const Digest digest = DigestOf(value.substr(kScheme.size()));
  ASSIGN_OR_RETURN(auto name, Look(digest, role));
  return Caller{.name = std::move(name),
                .digest = std::string(reinterpret_cast<const char*>(digest.data()), digest.size())};
}

absl::Status Access::AdmitAgain(const Caller& caller, Role role) {
  if (token_file_.empty()) return absl::OkStatus();
  Digest digest;
  std::memcpy(digest.data(), caller.digest.data(), digest.size());
  return Look(digest, role).status();
}

}  // namespace scanloc::server

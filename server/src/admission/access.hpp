#pragma once

#include <grpcpp/server_context.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ops/file_watch.hpp"

namespace scanloc::server {

/// What a token allows; each includes those before it.
enum class Role : std::uint8_t { kQuery, kView, kAdmin };

/// Who calls, as far as it is known.
struct Caller {
  std::string name;    ///< of the token; empty where the server asks for none
  std::string digest;  ///< of the token; never to be logged
};

/// The tokens of a server. Of each only the SHA-256 is kept. While it is not known what the file
/// holds, because it is gone, cannot be read or has a bad line, the tokens before stay in force for
/// kMaxUnknown, and then none is good until the file is. Thread-safe.
class Access {
 public:
  static constexpr std::chrono::minutes kMaxUnknown{5};

  /// An empty path admits everybody to everything but administration; what others are told is then
  /// kept only if the operator says so (ServerOptions::recent_answers). Errors tell the line, never
  /// the token.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Access>> Create(
      const std::string& token_file);

  /// Looks at the file every second from now on, and tells whether it can be used.
  void StartWatching(FileWatch::Tell tell);
  void StopWatching();

  /// Unauthenticated: no bearer token, or one that is not in the file. PermissionDenied: its role
  /// does not allow it. Unavailable: the file has been unknown for too long.
  [[nodiscard]] absl::StatusOr<Caller> Admit(const grpc::CallbackServerContext& context, Role role);

  /// Whether the caller would be admitted still.
  [[nodiscard]] absl::Status AdmitAgain(const Caller& caller, Role role);

  /// One look at the file, as if at that time.
  absl::Status LookAtFile(FileWatch::Clock::time_point now = FileWatch::Clock::now()) {
    return watch_.Look(now);
  }

 private:
  using Digest = std::array<unsigned char, 32>;
  struct Token {
    std::string name;
    Role role = Role::kQuery;
    Digest digest = {};
  };
  using Tokens = std::vector<Token>;
  explicit Access(const std::string& token_file);

  [[nodiscard]] static Digest DigestOf(std::string_view token);
  [[nodiscard]] static absl::StatusOr<Tokens> Parse(const std::string& text);
  [[nodiscard]] static absl::StatusOr<Token> ParseLine(const std::string& line);
  [[nodiscard]] absl::Status TakeUp(const std::string& text);
  [[nodiscard]] absl::StatusOr<std::string> Look(const Digest& digest, Role role);

  const std::string token_file_;
  std::mutex mutex_;  // held only to take or change the pointer
  std::shared_ptr<const Tokens> tokens_;
  FileWatch watch_;
};

}  // namespace scanloc::server

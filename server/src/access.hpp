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

namespace scanloc::server {

/// What a token allows; each includes those before it.
enum class Role : std::uint8_t { kQuery = 1, kAdmin = 2 };

/// Who calls, as far as it is known.
struct Caller {
  std::string name;    ///< of the token; empty where the server asks for none
  std::string digest;  ///< of the token; never to be logged
};

/// The tokens of a server. Of each only the SHA-256 is kept. The file is looked at again at most
/// once a second, when somebody calls, and by that one call; while a new one is bad, the one before
/// stays in force and the log says why. Thread-safe.
class Access {
 public:
  /// An empty path admits everybody to everything but administration. Errors tell the line, never
  /// the token.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Access>> Create(
      const std::string& token_file);

  /// Unauthenticated: no bearer token, or one that is not in the file. PermissionDenied: its role
  /// does not allow it.
  [[nodiscard]] absl::StatusOr<Caller> Admit(const grpc::CallbackServerContext& context, Role role);

  /// Whether the caller would be admitted still.
  [[nodiscard]] absl::Status AdmitAgain(const Caller& caller, Role role);

 private:
  using Digest = std::array<unsigned char, 32>;
  struct Token {
    std::string name;
    Role role = Role::kQuery;
    Digest digest = {};
  };
  using Tokens = std::vector<Token>;
  struct FileStamp {
    std::int64_t inode = 0;
    std::int64_t changed_ns = 0;
    std::int64_t num_bytes = -1;  // -1: no such file
    friend bool operator==(const FileStamp&, const FileStamp&) = default;
  };

  explicit Access(std::string token_file) : token_file_(std::move(token_file)) {}

  [[nodiscard]] static Digest DigestOf(std::string_view token);
  [[nodiscard]] static FileStamp StampOf(const std::string& path);
  [[nodiscard]] static absl::StatusOr<Tokens> Read(const std::string& path);
  [[nodiscard]] static absl::StatusOr<Token> ParseLine(const std::string& line);
  void LookAtFile();
  [[nodiscard]] std::shared_ptr<const Tokens> Current();
  [[nodiscard]] absl::StatusOr<std::string> Look(const Digest& digest, Role role);

  const std::string token_file_;
  std::mutex look_mutex_;  // held while the file is read; nobody waits for it
  FileStamp stamp_;
  std::chrono::steady_clock::time_point next_look_;
  std::mutex mutex_;  // held only to take or change the pointer
  std::shared_ptr<const Tokens> tokens_;
};

}  // namespace scanloc::server

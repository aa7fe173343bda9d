#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "file_layer.hpp"

struct sqlite3;
struct sqlite3_file;
struct sqlite3_stmt;

/// The only way to SQLite: owners that close, and results that are absl::Status.
namespace scanloc::mapdb {

/// How an error of a disk without room ends, for who builds a map.
inline constexpr absl::string_view kResumeAdvice =
    ". What was committed is kept: make room, then build with --resume";

/// One prepared statement of a Connection, which must outlive it.
class Statement {
 public:
  /// Parameters are bound by position, from 1. Text and blobs must live until Reset or the next
  /// bind of the same parameter. A failed bind makes the next Step fail.
  void Bind(int parameter, std::int64_t value);
  void Bind(int parameter, double value);
  void Bind(int parameter, std::string_view text);
  void Bind(int parameter, std::span<const std::byte> blob);

  /// True: there is a row to read. False: done.
  [[nodiscard]] absl::StatusOr<bool> Step();
  /// Steps a statement that gives no rows, and resets it.
  [[nodiscard]] absl::Status Run();
  /// The same with its parameters, in their order.
  template <typename... Values>
  [[nodiscard]] absl::Status RunWith(const Values&... values) {
    int parameter = 0;
    (Bind(++parameter, values), ...);
    return Run();
  }
  void Reset();

  /// That Step gave since the statement was prepared or reset.
  [[nodiscard]] std::int64_t num_rows() const { return num_rows_; }
  /// Columns of the current row, from 0; valid until the next Step. What is stored with another
  /// type is read as SQLite converts it: callers check contents by checksum.
  [[nodiscard]] std::int64_t Int(int column) const;
  [[nodiscard]] double Real(int column) const;
  [[nodiscard]] std::string_view Text(int column) const;
  [[nodiscard]] std::span<const std::byte> Blob(int column) const;

 private:
  friend class Connection;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  void NoteBound(int code);
  Statement(sqlite3_stmt* statement, std::string path)
      : path_(std::move(path)), statement_(statement) {}

  std::string path_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bind_error_ = 0;
  std::int64_t num_rows_ = 0;
};

/// One open database file. Not thread-safe.
class Connection {
 public:
  /// Opens an existing file, hardened against a hostile schema and damage. Waits at most
  /// busy_timeout_ms for locks. Where the rights to write lack, it gives a connection that cannot:
  /// is_read_only(). Statements run for as long as a sound file of this size could need and fail
  /// with DeadlineExceeded after that.
  [[nodiscard]] static absl::StatusOr<Connection> Open(const std::string& path, Access access,
                                                       int busy_timeout_ms);

  [[nodiscard]] absl::StatusOr<Statement> Prepare(std::string_view sql);
  [[nodiscard]] absl::Status Execute(const char* sql);
  /// The integer that a statement of one row and column gives.
  [[nodiscard]] absl::StatusOr<std::int64_t> QueryInt(std::string_view sql);
  void SetBusyTimeout(int milliseconds);
  /// From now on; without a limit where there is none.
  void LimitTime(std::optional<std::chrono::nanoseconds> limit);

  /// The first bytes of the file, read past SQLite's lock and cache; fewer if the file is shorter.
  [[nodiscard]] absl::StatusOr<std::string> ReadFront(std::size_t num_bytes);
  [[nodiscard]] absl::StatusOr<std::int64_t> FileBytes();
  /// Makes durable what is in the file.
  [[nodiscard]] absl::Status SyncFile();

  [[nodiscard]] bool is_read_only() const;
  /// The last failure was an unfinished write of a dead process that must be rolled back first.
  [[nodiscard]] bool needs_rollback() const;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  [[nodiscard]] absl::Status WithFile(const std::function<int(sqlite3_file&)>& use);

  struct TimeLimit {
    std::chrono::steady_clock::time_point end;
  };
  Connection(sqlite3* database, std::string path) : path_(std::move(path)), database_(database) {}

  std::string path_;
  std::unique_ptr<TimeLimit> time_limit_;  // SQLite holds its address
  std::unique_ptr<sqlite3, Close> database_;
};

/// DataLoss: "map 'PATH' is damaged: WHAT; ..." and what to do about it.
[[nodiscard]] absl::Status DamagedError(const std::string& path, absl::string_view what);
/// WHAT of a DamagedError, or the whole message of another status.
[[nodiscard]] std::string DamageOf(const absl::Status& status);

}  // namespace scanloc::mapdb

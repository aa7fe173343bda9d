#include "sqlite.hpp"

#include <sqlite3.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::mapdb {
namespace {

// A row holds a context: at most two bytes for each of kMaxDescriptorSide² cells, mask and keys.
constexpr int kMaxRowBytes = 4 << 20;
constexpr int kMaxSqlBytes = 16 << 10;
// What a slow disk reads in a second, and what even the smallest map may take.
constexpr std::int64_t kSlowestBytesPerSecond = 1'000'000;
constexpr std::chrono::seconds kLeastTime(60);
constexpr int kOperationsBetweenLooks = 1000;
constexpr absl::string_view kIsDamaged = "' is damaged: ";
constexpr absl::string_view kDamageAdvice = "; restore it from a copy or build it again";

absl::Status NoRoomError(const std::string& path, const std::string& what) {
  return absl::ResourceExhaustedError(absl::StrCat("cannot write map '", path, "': ", what,
                                                   "; the disk is full, over its quota or",
                                                   " failing", kResumeAdvice));
}

// SQLite tells ENOSPC as SQLITE_FULL, but a quota or a limit on file size as a failed write.
absl::Status IoError(int code, const std::string& path, const std::string& what) {
  switch (code) {
    case SQLITE_IOERR_SHORT_READ:
      return DamagedError(path, "it is truncated");
    case SQLITE_IOERR_WRITE:
    case SQLITE_IOERR_FSYNC:
    case SQLITE_IOERR_DIR_FSYNC:
    case SQLITE_IOERR_TRUNCATE:
      return NoRoomError(path, what);
    default:
      return absl::DataLossError(
          absl::StrCat("cannot read or write map '", path, "': ", what, "; check the disk"));
  }
}

absl::Status SqliteError(sqlite3* database, int code, const std::string& path) {
  const std::string what = Printable(sqlite3_errmsg(database));
  switch (code & 0xff) {
    case SQLITE_NOTADB:
      return absl::InvalidArgumentError(
          absl::StrCat("'", path, "' is not a scanloc map: it is not an SQLite file"));
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return absl::UnavailableError(
          absl::StrCat("map '", path,
                       "' is in use by another build; wait until that has ended, then try again"));
    case SQLITE_INTERRUPT:
      return absl::DeadlineExceededError(absl::StrCat(
          "reading map '", path, "' takes longer than any sound map of its size; check the disk, ",
          "and where the map comes from"));
    case SQLITE_FULL:
      return NoRoomError(path, what);
    case SQLITE_IOERR:
      return IoError(code, path, what);
    case SQLITE_NOMEM:
      return absl::ResourceExhaustedError(absl::StrCat("out of memory in map '", path, "'"));
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return absl::PermissionDeniedError(absl::StrCat(
          "cannot open map '", path, "': ", what, "; check the rights to the file and its folder"));
    case SQLITE_READONLY:
      if (code == SQLITE_READONLY_DBMOVED) {
        return absl::FailedPreconditionError(
            absl::StrCat("map '", path, "' was moved, replaced or removed while it was written; ",
                         "put its file back and build with --resume, or build it again"));
      }
      return absl::PermissionDeniedError(
          absl::StrCat("cannot write map '", path, "': ", what,
                       "; check the rights to the file and its folder"));
    default:
      return DamagedError(path, what);
  }
}

// A relative name that SQLite takes for something else, such as ":memory:", is none with "./".
std::string PlainPath(const std::string& path) {
  return path.starts_with('/') ? path : absl::StrCat("./", path);
}

absl::Status Harden(sqlite3* database, const std::string& path) {
  for (const auto& [option, value] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                      {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                      {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                      {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                      {SQLITE_DBCONFIG_ENABLE_FKEY, 1}}) {
    if (const int code = sqlite3_db_config(database, option, value, nullptr); code != SQLITE_OK) {
      return SqliteError(database, code, path);
    }
  }
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, kMaxRowBytes);
  sqlite3_limit(database, SQLITE_LIMIT_SQL_LENGTH, kMaxSqlBytes);
  sqlite3_limit(database, SQLITE_LIMIT_ATTACHED, 0);
  return absl::OkStatus();
}

}  // namespace

absl::Status DamagedError(const std::string& path, absl::string_view what) {
  // It may hold what stands in the file.
  return absl::DataLossError(absl::StrCat("map '", path, kIsDamaged,
                                          Printable({what.data(), what.size()}), kDamageAdvice));
}

std::string DamageOf(const absl::Status& status) {
  absl::string_view what = status.message();
  if (const std::size_t start = what.find(kIsDamaged); start != absl::string_view::npos) {
    what.remove_prefix(start + kIsDamaged.size());
  }
  absl::ConsumeSuffix(&what, kDamageAdvice);
  return absl::StrCat(what);
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

void Statement::NoteBound(int code) {
  if (code != SQLITE_OK) bind_error_ = code;
}

void Statement::Bind(int parameter, std::int64_t value) {
  NoteBound(sqlite3_bind_int64(statement_.get(), parameter, value));
}

void Statement::Bind(int parameter, double value) {
  NoteBound(sqlite3_bind_double(statement_.get(), parameter, value));
}

void Statement::Bind(int parameter, std::string_view text) {
  NoteBound(sqlite3_bind_text64(statement_.get(), parameter, text.data(), text.size(),
                                SQLITE_STATIC, SQLITE_UTF8));
}

void Statement::Bind(int parameter, std::span<const std::byte> blob) {
  // An empty span may have no address, which SQLite would take for NULL.
  const void* data = blob.empty() ? "" : static_cast<const void*>(blob.data());
  NoteBound(sqlite3_bind_blob64(statement_.get(), parameter, data, blob.size(), SQLITE_STATIC));
}

absl::StatusOr<bool> Statement::Step() {
  const int code = bind_error_ != 0 ? bind_error_ : sqlite3_step(statement_.get());
  num_rows_ += code == SQLITE_ROW ? 1 : 0;
  if (code == SQLITE_ROW || code == SQLITE_DONE) return code == SQLITE_ROW;
  return SqliteError(sqlite3_db_handle(statement_.get()), code, path_);
}

absl::Status Statement::Run() {
  const absl::StatusOr<bool> row = Step();
  Reset();
  return row.status();
}

void Statement::Reset() {
  sqlite3_reset(statement_.get());
  bind_error_ = 0;
  num_rows_ = 0;
}

std::int64_t Statement::Int(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::Real(int column) const { return sqlite3_column_double(statement_.get(), column); }

std::string_view Statement::Text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text == nullptr ? std::string_view() : std::string_view(text, size);
}

std::span<const std::byte> Statement::Blob(int column) const {
  const auto* blob = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return {blob, blob == nullptr ? 0 : static_cast<std::size_t>(size)};
}

void Connection::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

absl::StatusOr<Connection> Connection::Open(const std::string& path, Access access,
                                            int busy_timeout_ms) {
  const int flags = (access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE) |
                    SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_PRIVATECACHE | SQLITE_OPEN_EXRESCODE;
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(PlainPath(path).c_str(), &database, flags, FileLayer(access));
  Connection connection(database, path);
  if (code != SQLITE_OK) return SqliteError(database, code, path);
  RETURN_IF_ERROR(Harden(database, path));
  connection.SetBusyTimeout(busy_timeout_ms);
  ASSIGN_OR_RETURN(const std::int64_t file_bytes, connection.FileBytes());
  connection.LimitTime(kLeastTime + std::chrono::seconds(file_bytes / kSlowestBytesPerSecond));
  return connection;
}

absl::StatusOr<Statement> Connection::Prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()),
                                      &statement, nullptr);
  if (code != SQLITE_OK) return SqliteError(database_.get(), code, path_);
  return Statement(statement, path_);
}

absl::Status Connection::Execute(const char* sql) {
  const int code = sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? absl::OkStatus() : SqliteError(database_.get(), code, path_);
}

absl::StatusOr<std::int64_t> Connection::QueryInt(std::string_view sql) {
  ASSIGN_OR_RETURN(Statement statement, Prepare(sql));
  ASSIGN_OR_RETURN(const bool row, statement.Step());
  return row ? statement.Int(0) : 0;
}

void Connection::LimitTime(std::optional<std::chrono::nanoseconds> limit) {
  if (!limit.has_value()) {
    sqlite3_progress_handler(database_.get(), 0, nullptr, nullptr);
    return;
  }
  time_limit_ = std::make_unique<TimeLimit>(TimeLimit{std::chrono::steady_clock::now() + *limit});
  const auto is_over = [](void* time_limit) {
    return std::chrono::steady_clock::now() > static_cast<TimeLimit*>(time_limit)->end ? 1 : 0;
  };
  sqlite3_progress_handler(database_.get(), kOperationsBetweenLooks, is_over, time_limit_.get());
}

void Connection::SetBusyTimeout(int milliseconds) {
  sqlite3_busy_timeout(database_.get(), milliseconds);
}

// Through SQLite's own handle: closing a second one would drop this process's locks on the file.
absl::Status Connection::WithFile(const std::function<int(sqlite3_file&)>& use) {
  sqlite3_file* file = nullptr;
  int code = sqlite3_file_control(database_.get(), "main", SQLITE_FCNTL_FILE_POINTER, &file);
  if (code == SQLITE_OK) {
    code = file->pMethods == nullptr ? SQLITE_CANTOPEN : use(*file);
  }
  return code == SQLITE_OK ? absl::OkStatus() : SqliteError(database_.get(), code, path_);
}

absl::StatusOr<std::string> Connection::ReadFront(std::size_t num_bytes) {
  ASSIGN_OR_RETURN(const std::int64_t size, FileBytes());
  std::string front(std::min<std::int64_t>(static_cast<std::int64_t>(num_bytes), size), '\0');
  if (front.empty()) return front;
  absl::Status status = WithFile([&](sqlite3_file& file) {
    return file.pMethods->xRead(&file, front.data(), static_cast<int>(front.size()), 0);
  });
  return status.ok() ? absl::StatusOr<std::string>(std::move(front)) : status;
}

absl::StatusOr<std::int64_t> Connection::FileBytes() {
  sqlite3_int64 size = 0;
  absl::Status status =
      WithFile([&](sqlite3_file& file) { return file.pMethods->xFileSize(&file, &size); });
  return status.ok() ? absl::StatusOr<std::int64_t>(size) : status;
}

absl::Status Connection::SyncFile() {
  return WithFile(
      [](sqlite3_file& file) { return file.pMethods->xSync(&file, SQLITE_SYNC_NORMAL); });
}

bool Connection::is_read_only() const { return sqlite3_db_readonly(database_.get(), "main") != 0; }

bool Connection::needs_rollback() const {
  return sqlite3_extended_errcode(database_.get()) == SQLITE_READONLY_ROLLBACK;
}

}  // namespace scanloc::mapdb

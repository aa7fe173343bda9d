// Databases of rosbag2: a table of topics and one of messages.
#include <sqlite3.h>

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "bag/bag_file.hpp"
#include "bag/decompress.hpp"
#include "file_bytes.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::size_t kMaxTopics = 100'000;

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;

struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

std::string_view Text(sqlite3_stmt* statement, int column) {
  const void* const bytes = sqlite3_column_blob(statement, column);
  const int num_bytes = sqlite3_column_bytes(statement, column);
  if (bytes == nullptr || num_bytes <= 0) return {};
  return {static_cast<const char*>(bytes), static_cast<std::size_t>(num_bytes)};
}

class Ros2Database : public BagFile {
 public:
  Ros2Database(Database database, std::string path)
      : database_(std::move(database)), path_(std::move(path)) {}

  absl::Status Index() {
    RETURN_IF_ERROR(CheckTables());
    ASSIGN_OR_RETURN(const auto topic_of, ReadTopics());
    ASSIGN_OR_RETURN(const Statement rows,
                     Prepare("SELECT rowid, topic_id, timestamp FROM messages ORDER BY rowid"));
    // Pages that point at each other can hold more rows than the file has bytes.
    std::error_code error;
    const std::uintmax_t num_bytes = std::filesystem::file_size(path_, error);
    std::size_t num_nameless = 0;
    int step = SQLITE_ROW;
    while ((step = sqlite3_step(rows.get())) == SQLITE_ROW) {
      if (messages_.size() + num_nameless > num_bytes)
        return Error("is damaged: holds more messages than bytes");
      const auto topic = topic_of.find(sqlite3_column_int64(rows.get(), 1));
      if (topic == topic_of.end()) {
        ++num_nameless;
        continue;
      }
      const std::int64_t row = sqlite3_column_int64(rows.get(), 0);
      messages_.push_back({.log_time_ns = sqlite3_column_int64(rows.get(), 2),
                           .topic = topic->second,
                           .at = static_cast<std::uint64_t>(row)});
    }
    if (num_nameless > 0) {
      AddNote(absl::StrCat(path_, " is damaged: of ", num_nameless,
                           " messages it does not name the topic; they are left out"));
    }
    if (step != SQLITE_DONE) {
      // A database that was cut off is read as far as it goes.
      if (messages_.empty()) return Error("its messages cannot be read");
      notes_.push_back(absl::StrCat(path_, " is damaged or cut off (",
                                    sqlite3_errmsg(database_.get()),
                                    "); what comes before is read"));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<MessageBytes> Read(const MessageRef& message) const override {
    const std::lock_guard lock(mutex_);
    ASSIGN_OR_RETURN(const Statement row, Prepare("SELECT data FROM messages WHERE rowid = ?"));
    sqlite3_bind_int64(row.get(), 1, static_cast<std::int64_t>(message.at));
    if (sqlite3_step(row.get()) != SQLITE_ROW) {
      const absl::Status error = Error(absl::StrCat("message ", message.at, " cannot be read"));
      const bool is_damaged = sqlite3_errcode(database_.get()) == SQLITE_CORRUPT;
      return is_damaged ? absl::DataLossError(error.message()) : error;
    }
    const std::string_view data = Text(row.get(), 0);
    ASSIGN_OR_RETURN(FileBytes bytes, Decompress(Compression::kNone, data, data.size()));
    MessageBytes read;
    read.holder = std::make_shared<const FileBytes>(std::move(bytes));
    read.bytes = read.holder->view();
    return read;
  }

 private:
  [[nodiscard]] absl::Status Error(std::string_view what) const {
    return absl::InvalidArgumentError(
        absl::StrCat(path_, ": ", ToAbsl(what), ": ", sqlite3_errmsg(database_.get())));
  }
  [[nodiscard]] absl::StatusOr<Statement> Prepare(const char* sql) const {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr) != SQLITE_OK) {
      return Error("is no database of rosbag2");
    }
    return Statement(statement);
  }
  // A view, or a column that is computed, would run what the file says.
  [[nodiscard]] absl::Status CheckTables() const {
    ASSIGN_OR_RETURN(const Statement tables,
                     Prepare("SELECT count(*) FROM sqlite_schema WHERE type "
                             "= 'table' AND name IN ('topics', 'messages')"
                             " AND sql LIKE 'CREATE TABLE%'"));
    if (sqlite3_step(tables.get()) != SQLITE_ROW) return Error("cannot be read");
    if (sqlite3_column_int(tables.get(), 0) != 2) {
      return absl::InvalidArgumentError(absl::StrCat(
          path_, ": has no tables topics and messages: no database of rosbag2 that is read"));
    }
    ASSIGN_OR_RETURN(
        const Statement computed,
        Prepare("SELECT count(*) FROM (SELECT hidden FROM pragma_table_xinfo('topics') UNION ALL"
                " SELECT hidden FROM pragma_table_xinfo('messages')) WHERE hidden != 0"));
    if (sqlite3_step(computed.get()) != SQLITE_ROW) return Error("cannot be read");
    if (sqlite3_column_int(computed.get(), 0) == 0) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(path_, ": has computed columns; none are read"));
  }
  [[nodiscard]] absl::StatusOr<std::map<std::int64_t, std::uint32_t>> ReadTopics() {
    ASSIGN_OR_RETURN(
        const Statement rows,
        Prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id"));
    std::map<std::int64_t, std::uint32_t> topic_of;
    int step = SQLITE_ROW;
    while ((step = sqlite3_step(rows.get())) == SQLITE_ROW) {
      if (topics_.size() == kMaxTopics) return Error("has too many topics");
      topic_of[sqlite3_column_int64(rows.get(), 0)] = static_cast<std::uint32_t>(topics_.size());
      const bool is_cdr = Text(rows.get(), 3) == "cdr";
      topics_.push_back({.name = std::string(Text(rows.get(), 1)),
                         .type = ShortType(Text(rows.get(), 2)),
                         .format = is_cdr ? WireFormat::kCdr : WireFormat::kOther});
    }
    if (step != SQLITE_DONE) return Error("its topics cannot be read");
    return topic_of;
  }

  Database database_;
  std::string path_;
  mutable std::mutex mutex_;  // guards the database
};

// The path in a URI of SQLite.
std::string EscapeForUri(const std::string& path) {
  std::string escaped;
  for (const char c : path) {
    const bool is_plain = c != '%' && c != '?' && c != '#' && c > ' ' && c <= '~';
    is_plain ? escaped.push_back(c)
             : absl::StrAppend(&escaped, "%", absl::BytesToHexString(absl::string_view(&c, 1)));
  }
  return escaped;
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagFile>> OpenRos2Database(const std::string& path) {
  // Immutable: nothing is written, no journal beside the file is looked at or rolled back.
  sqlite3* raw = nullptr;
  const int opened =
      sqlite3_open_v2(absl::StrCat("file:", EscapeForUri(path), "?mode=ro&immutable=1").c_str(),
                      &raw, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database(raw);
  if (opened != SQLITE_OK) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": cannot be opened: ", raw == nullptr ? "no memory" : sqlite3_errmsg(raw)));
  }
  sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, limits::kMaxBagChunkBytes);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  // Nothing is written; but without it SQLite reads no database that is shorter than its head says.
  sqlite3_db_config(raw, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  auto bag = std::make_unique<Ros2Database>(std::move(database), path);
  RETURN_IF_ERROR(bag->Index());
  const std::string wal = absl::StrCat(path, "-wal");
  std::error_code error;
  if (const std::uintmax_t num_bytes = std::filesystem::file_size(wal, error);
      !error && num_bytes > 0) {
    bag->AddNote(absl::StrCat(wal, " may hold messages that a recorder did not get to move into ",
                              path, ": they are not read; `sqlite3 ", path,
                              " 'PRAGMA wal_checkpoint'` moves them"));
  }
  return bag;
}

}  // namespace scanloc::dataset

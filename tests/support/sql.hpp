#pragma once

#include <sqlite3.h>

#include <stdexcept>
#include <string>

namespace scanloc::test {

/// Runs SQL on a database file behind mapdb's back; makes the file if there is none.
inline void Sql(const std::string& path, const std::string& statements) {
  sqlite3* database = nullptr;
  char* error = nullptr;
  int code = sqlite3_open(path.c_str(), &database);
  if (code == SQLITE_OK) {
    code = sqlite3_exec(database, statements.c_str(), nullptr, nullptr, &error);
  }
  const std::string message = error != nullptr ? error : sqlite3_errstr(code);
  sqlite3_free(error);
  sqlite3_close(database);
  if (code != SQLITE_OK) throw std::runtime_error("SQL on " + path + ": " + message);
}

}  // namespace scanloc::test

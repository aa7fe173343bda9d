#include <libpq-fe.h>
#include <poll.h>

#include <charconv>
#include <chrono>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "kinds.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::catalogue {
namespace {

constexpr const char* kMakeTables[] = {
    "SELECT pg_advisory_xact_lock(1397509955)",  // two at once would make them twice
    "CREATE TABLE IF NOT EXISTS scanloc_versions (id BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY "
    "KEY,"
    " region TEXT NOT NULL, content_id TEXT NOT NULL, sha256 TEXT NOT NULL, num_bytes BIGINT NOT "
    "NULL,"
    " num_places BIGINT NOT NULL, area POLYGON NOT NULL, published_by TEXT NOT NULL,"
    " published_at TIMESTAMPTZ NOT NULL DEFAULT clock_timestamp())",
    "CREATE INDEX IF NOT EXISTS scanloc_versions_region ON scanloc_versions (region, id)",
    "CREATE TABLE IF NOT EXISTS scanloc_live (region TEXT PRIMARY KEY,"
    " version BIGINT NOT NULL REFERENCES scanloc_versions (id),"
    " since TIMESTAMPTZ NOT NULL DEFAULT clock_timestamp())"};
// Publishers of one region come one after the other, so that the one who commits last is in force.
constexpr const char* kLockRegion =
    "SELECT pg_advisory_xact_lock(hashtextextended($1, 1397509955))";
constexpr const char* kInsertVersion =
    "INSERT INTO scanloc_versions (region, content_id, sha256, num_bytes, num_places, area,"
    " published_by) VALUES ($1, $2, $3, $4, $5, $6, $7) RETURNING id";
// Databases of before polygons on earth lack the column. Who publishes the first adds it; who only
// reads need not be allowed to.
constexpr const char* kHasOnEarth =
    "SELECT FROM pg_attribute WHERE attrelid = 'scanloc_versions'::regclass AND attname = "
    "'on_earth'";
constexpr const char* kAddOnEarth =
    "ALTER TABLE scanloc_versions ADD COLUMN IF NOT EXISTS on_earth BOOLEAN NOT NULL DEFAULT false";
constexpr const char* kInsertOnEarth =
    "INSERT INTO scanloc_versions (region, content_id, sha256, num_bytes, num_places, area,"
    " published_by, on_earth) VALUES ($1, $2, $3, $4, $5, $6, $7, true) RETURNING id";
constexpr const char* kPutInForce =
    "INSERT INTO scanloc_live (region, version) VALUES ($1, $2) ON CONFLICT (region)"
    " DO UPDATE SET version = EXCLUDED.version, since = clock_timestamp()";
constexpr const char* kWithdraw = "DELETE FROM scanloc_live WHERE region = $1 RETURNING region";
constexpr const char* kFindBefore =
    "SELECT v.id FROM scanloc_versions v JOIN scanloc_live l ON l.region = v.region"
    " JOIN scanloc_versions now ON now.id = l.version"
    " WHERE v.region = $1 AND v.id < l.version AND v.sha256 <> now.sha256"
    " ORDER BY v.id DESC LIMIT 1";
constexpr const char* kFindContent =
    "SELECT id FROM scanloc_versions WHERE region = $1 AND content_id = $2 ORDER BY id DESC LIMIT "
    "1";
constexpr const char* kColumns =
    "SELECT v.region, v.content_id, v.sha256, v.num_bytes, v.num_places, v.area,"
    " coalesce(to_jsonb(v) ->> 'on_earth', 'false'), v.published_by,"
    " (extract(epoch FROM v.published_at) * 1000)::BIGINT FROM scanloc_versions v";
constexpr const char* kNotify = "SELECT pg_notify('scanloc_live', $1)";
constexpr const char* kListen = "LISTEN scanloc_live";

/// A database gives up a statement after its time, and who asks it a little later: a database that
/// hangs says nothing. Less than what scanlocd has to end.
constexpr const char* kOptions =
    "-c statement_timeout=8000 -c lock_timeout=8000 -c client_min_messages=warning";
constexpr std::chrono::seconds kPatience(9);

using Clock = std::chrono::steady_clock;
using Texts = std::vector<std::string>;

template <typename T>
bool Parse(const char* text, T& value) {
  const std::string_view all(text);
  return std::from_chars(all.data(), all.data() + all.size(), value).ptr == all.data() + all.size();
}

/// As PostgreSQL writes a polygon: ((x,y),(x,y)).
std::string PolygonText(const std::vector<Corner>& corners) {
  return absl::StrCat("(",
                      absl::StrJoin(corners, ",",
                                    [](std::string* text, const Corner& corner) {
                                      absl::StrAppendFormat(text, "(%.17g,%.17g)", corner.x,
                                                            corner.y);
                                    }),
                      ")");
}

bool ParsePolygon(absl::string_view text, std::vector<Corner>& corners) {
  const std::vector<absl::string_view> numbers =
      absl::StrSplit(text, absl::ByAnyChar("(),"), absl::SkipEmpty());
  corners.resize(numbers.size() / 2);
  bool is_read = numbers.size() % 2 == 0;
  for (std::size_t i = 0; is_read && i < corners.size(); ++i) {
    is_read = absl::SimpleAtod(numbers[2 * i], &corners[i].x) &&
              absl::SimpleAtod(numbers[2 * i + 1], &corners[i].y);
  }
  return is_read;
}

class PostgresCatalogue : public Catalogue {
 public:
  explicit PostgresCatalogue(std::string url) : url_(std::move(url)) {}

  absl::Status Publish(const Version& version) override {
    RETURN_IF_ERROR(Validate(version));
    return Transaction([&]() -> absl::Status {
      RETURN_IF_ERROR(Run(kLockRegion, {version.region}).status());
      if (version.area.is_on_earth) {
        RETURN_IF_ERROR(AddOnEarth());
      }
      ASSIGN_OR_RETURN(const auto inserted,
                       Run(version.area.is_on_earth ? kInsertOnEarth : kInsertVersion,
                           {version.region, version.content_id, version.sha256,
                            absl::StrCat(version.num_bytes), absl::StrCat(version.num_places),
                            PolygonText(version.area.corners), version.published_by}));
      return PutInForce(version.region, PQgetvalue(inserted.get(), 0, 0));
    });
  }

  absl::StatusOr<Version> Rollback(const std::string& region,
                                   const std::string& content_id) override {
    Version now;
    const absl::Status status = Transaction([&]() -> absl::Status {
      RETURN_IF_ERROR(Run(kLockRegion, {region}).status());
      ASSIGN_OR_RETURN(const auto found, content_id.empty()
                                             ? Run(kFindBefore, {region})
                                             : Run(kFindContent, {region, content_id}));
      if (PQntuples(found.get()) == 0) {
        return absl::NotFoundError(
            absl::StrCat("region ", region, " has no version ",
                         content_id.empty() ? "before the one in force" : content_id,
                         "; scanloc catalogue tells which it has"));
      }
      const std::string id = PQgetvalue(found.get(), 0, 0);
      RETURN_IF_ERROR(PutInForce(region, id));
      ASSIGN_OR_RETURN(std::vector<Version> versions,
                       Select(absl::StrCat(kColumns, " WHERE v.id = $1"), {id}));
      now = versions.front();
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
    return now;
  }

  absl::Status Withdraw(const std::string& region) override {
    return Transaction([&]() -> absl::Status {
      ASSIGN_OR_RETURN(const auto withdrawn, Run(kWithdraw, {region}));
      if (PQntuples(withdrawn.get()) == 0) {
        return absl::NotFoundError(absl::StrCat("no map of region ", region, " is in force"));
      }
      return Run(kNotify, {region}).status();
    });
  }

  absl::StatusOr<std::vector<Version>> Live() override {
    return Select(
        absl::StrCat(kColumns, " JOIN scanloc_live l ON l.version = v.id ORDER BY v.region"), {});
  }

  absl::StatusOr<std::vector<Version>> History(const std::string& region) override {
    return Select(absl::StrCat(kColumns, " WHERE v.region = $1 ORDER BY v.id DESC"), {region});
  }

  absl::Status AwaitChange(std::chrono::milliseconds longest) override {
    RETURN_IF_ERROR(Connect());
    if (!is_listening_) {
      RETURN_IF_ERROR(Run(kListen, {}).status());
      is_listening_ = true;
      return absl::OkStatus();  // something may have changed before
    }
    if (TakeNotices()) return absl::OkStatus();
    pollfd socket{PQsocket(connection_.get()), POLLIN, 0};
    poll(&socket, 1, static_cast<int>(longest.count()));
    if (PQconsumeInput(connection_.get()) == 0) return Lost("the connection ended");
    (void)TakeNotices();
    return absl::OkStatus();
  }

 private:
  struct Finish {
    void operator()(PGconn* connection) const { PQfinish(connection); }
    void operator()(PGresult* result) const { PQclear(result); }
  };
  using Result = std::unique_ptr<PGresult, Finish>;

  /// Unavailable; the next call connects anew.
  absl::Status Lost(const std::string& why) {
    connection_.reset();
    is_listening_ = false;
    return absl::UnavailableError(
        absl::StrCat("the catalogue's database cannot be reached: ", why,
                     "; is it running, and is the URL of --catalogue right?"));
  }

  absl::Status Connect() {
    if (connection_ != nullptr && PQstatus(connection_.get()) == CONNECTION_OK) {
      return absl::OkStatus();
    }
    is_listening_ = false;
    // A host that is gone is noticed within seconds, in a query, too.
    const char* names[] = {"dbname",          "connect_timeout", "tcp_user_timeout",
                           "keepalives_idle", "options",         nullptr};
    const char* values[] = {url_.c_str(), "5", "5000", "5", kOptions, nullptr};
    connection_.reset(PQconnectdbParams(names, values, 1));
    if (connection_ == nullptr) return absl::ResourceExhaustedError("out of memory");
    if (PQstatus(connection_.get()) != CONNECTION_OK) {
      return Lost(ErrorText());
    }
    PQsetnonblocking(connection_.get(), 1);
    return MakeTables();
  }

  absl::Status MakeTables() {
    ASSIGN_OR_RETURN(const auto exists, Run("SELECT to_regclass('scanloc_live')", {}));
    if (PQgetisnull(exists.get(), 0, 0) == 0) return absl::OkStatus();
    return TransactionOn([&]() -> absl::Status {
      for (const char* sql : kMakeTables) {
        RETURN_IF_ERROR(Run(sql, {}).status());
      }
      return absl::OkStatus();
    });
  }

  absl::StatusOr<Result> Run(const std::string& sql, const Texts& parameters) {
    std::vector<const char*> values;
    values.reserve(parameters.size());
    for (const std::string& parameter : parameters) values.push_back(parameter.c_str());
    if (PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()), nullptr,
                          values.data(), nullptr, nullptr, 0) == 0) {
      return Lost(ErrorText());
    }
    const Clock::time_point end = Clock::now() + kPatience;
    Result result;
    while (true) {
      if (!AwaitResult(end)) {
        return Lost(absl::StrCat("it said nothing for ", kPatience.count(), " s"));
      }
      Result next(PQgetResult(connection_.get()));
      if (next == nullptr) break;
      result = std::move(next);
    }
    const ExecStatusType status = PQresultStatus(result.get());
    if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) return result;
    if (PQstatus(connection_.get()) != CONNECTION_OK) return Lost(ErrorText());
    return absl::UnavailableError(absl::StrCat("the catalogue's database refuses: ", ErrorText()));
  }

  /// Whether PQgetResult has something to say, be it that the connection ended; false: not by then.
  bool AwaitResult(Clock::time_point end) {
    PGconn* const connection = connection_.get();
    while (true) {
      const bool has_more_to_send = PQflush(connection) == 1;
      if (!has_more_to_send && PQisBusy(connection) == 0) return true;
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
      if (left.count() <= 0) return false;
      const int events = has_more_to_send ? POLLIN | POLLOUT : POLLIN;
      pollfd socket{PQsocket(connection), static_cast<short>(events), 0};
      poll(&socket, 1, static_cast<int>(left.count()));
      if (PQconsumeInput(connection) == 0) return true;
    }
  }

  [[nodiscard]] std::string ErrorText() const {
    return std::string(absl::StripAsciiWhitespace(PQerrorMessage(connection_.get())));
  }

  /// On a connection that is there.
  template <typename Act>
  absl::Status TransactionOn(Act&& act) {
    RETURN_IF_ERROR(Run("BEGIN", {}).status());
    absl::Status status = act();
    if (connection_ == nullptr) return status;
    const absl::Status ended = Run(status.ok() ? "COMMIT" : "ROLLBACK", {}).status();
    if (status.ok() && !ended.ok() && connection_ == nullptr) {
      return absl::UnavailableError(absl::StrCat(
          ended.message(), "; it may have been done all the same: scanloc catalogue tells"));
    }
    status.Update(ended);
    return status;
  }
  template <typename Act>
  absl::Status Transaction(Act&& act) {
    RETURN_IF_ERROR(Connect());
    return TransactionOn(std::forward<Act>(act));
  }

  absl::Status PutInForce(const std::string& region, const std::string& id) {
    absl::Status status = Run(kPutInForce, {region, id}).status();
    return status.ok() ? Run(kNotify, {region}).status() : status;
  }

  absl::Status AddOnEarth() {
    const auto found = Run(kHasOnEarth, {});
    if (!found.ok() || PQntuples(found->get()) > 0) return found.status();
    return Run(kAddOnEarth, {}).status();
  }

  absl::StatusOr<std::vector<Version>> Select(const std::string& sql, const Texts& parameters) {
    RETURN_IF_ERROR(Connect());
    ASSIGN_OR_RETURN(const auto rows, Run(sql, parameters));
    std::vector<Version> versions;
    for (int row = 0; row < PQntuples(rows.get()); ++row) {
      const auto text = [&](int column) { return PQgetvalue(rows.get(), row, column); };
      Version version{.region = text(0),
                      .content_id = text(1),
                      .sha256 = text(2),
                      .area = {.corners = {}, .is_on_earth = text(6) == std::string_view("true")},
                      .published_by = text(7)};
      const bool is_read =
          Parse(text(3), version.num_bytes) && Parse(text(4), version.num_places) &&
          ParsePolygon(text(5), version.area.corners) && Parse(text(8), version.published_ms);
      const absl::Status status = Validate(version);
      if (!is_read || !status.ok()) {
        return absl::DataLossError(absl::StrCat("the catalogue's database holds no version in row ",
                                                row, ": ", status.message()));
      }
      versions.push_back(std::move(version));
    }
    return versions;
  }

  bool TakeNotices() {
    bool is_any = false;
    while (PGnotify* notice = PQnotifies(connection_.get())) {
      PQfreemem(notice);
      is_any = true;
    }
    return is_any;
  }

  std::string url_;
  std::unique_ptr<PGconn, Finish> connection_;
  bool is_listening_ = false;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Catalogue>> OpenPostgresCatalogue(const std::string& url) {
  return std::make_unique<PostgresCatalogue>(url);
}

}  // namespace scanloc::catalogue

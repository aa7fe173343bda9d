#include "file_payload.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "open_map.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

constexpr int kMaxReaders = 64;
/// Between two looks whether anybody still waits: for a connection, for a build that commits, and
/// of rows that are read.
constexpr std::chrono::milliseconds kLook(20);
constexpr std::size_t kRowsBetweenLooks = 16;
/// So many rows are read by two threads: half a millisecond of work.
constexpr std::size_t kLeastForTwo = 64;
/// A build that commits keeps readers waiting; one that takes longer has more to write than a
/// reader can wait for.
constexpr std::chrono::seconds kLongestCommit(5);
/// Places that a scrub reads in one transaction, which keeps a build from committing.
constexpr std::size_t kScrubBatch = 64;
constexpr int kMaxTries = 100;  // to read one batch

int NumReaders(const OpenOptions& options) {
  const int wanted = options.num_readers > 0
                         ? options.num_readers
                         : std::max(2, static_cast<int>(std::thread::hardware_concurrency()));
  return std::min(wanted, kMaxReaders);
}

// What kind of failure it is for who has the map open: it was a map when it was opened.
absl::Status Reclassified(const absl::Status& status) {
  if (absl::IsInvalidArgument(status)) return absl::DataLossError(status.message());
  if (absl::IsPermissionDenied(status)) return absl::UnavailableError(status.message());
  return status;
}

absl::Status Cancelled() { return absl::CancelledError("nobody waits for the answer any more"); }

}  // namespace

/// A connection for as long as this lives; null where nobody waits any more.
class FilePayload::Lease {
 public:
  Lease(const FilePayload& payload, const SearchControl& control) : payload_(payload) {
    std::unique_lock lock(payload_.mutex_);
    while (payload_.idle_.empty()) {
      if (control.IsUnwanted()) return;
      payload_.is_back_.wait_for(lock, kLook);
    }
    reader_ = std::move(payload_.idle_.back());
    payload_.idle_.pop_back();
  }
  ~Lease() {
    if (reader_ == nullptr) return;
    const std::lock_guard lock(payload_.mutex_);
    payload_.idle_.push_back(std::move(reader_));
    payload_.is_back_.notify_one();
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

  [[nodiscard]] Reader* get() const { return reader_.get(); }

 private:
  const FilePayload& payload_;
  std::unique_ptr<Reader> reader_;
};

FilePayload::FilePayload(const MapHead& head, ExpectedRows expected,
                         std::shared_ptr<PayloadCache> cache)
    : shapes_(ContextShapes(head.params)),
      has_structures_(head.params.structure.enabled),
      schema_version_(head.schema_version),
      params_(head.params),
      expected_(std::move(expected)),
      cache_(std::move(cache)),
      number_(cache_->NewMap()) {}

absl::StatusOr<std::unique_ptr<FilePayload::Reader>> FilePayload::OpenReader(
    const std::string& path, const MapHead& head) {
  ASSIGN_OR_RETURN(Connection connection, OpenForReading(path));
  ASSIGN_OR_RETURN(const MapHead now, ReadHead(connection));
  if (now.content_id != head.content_id) {
    return absl::UnavailableError(
        absl::StrCat("map '", path, "' was written while it was opened; open it again"));
  }
  connection.LimitTime(std::nullopt);
  connection.SetBusyTimeout(static_cast<int>(kLook.count()));
  for (const char* sql : {schema::kCommit, schema::kConfigureLookup}) {
    RETURN_IF_ERROR(connection.Execute(sql));
  }
  ASSIGN_OR_RETURN(Statement context, connection.Prepare(schema::kSelectContext));
  ASSIGN_OR_RETURN(Statement structure, connection.Prepare(schema::kSelectStructure));
  ASSIGN_OR_RETURN(Statement keys, connection.Prepare(schema::kSelectKeysOfPlace));
  std::optional<Statement> bearings;
  if (head.schema_version >= schema::kBearingsVersion) {
    ASSIGN_OR_RETURN(bearings, connection.Prepare(schema::kSelectBearingsOfPlace));
  }
  return std::make_unique<Reader>(Reader{std::move(connection),
                                         std::move(context),
                                         std::move(structure),
                                         std::move(keys),
                                         std::move(bearings),
                                         KeysRowReader(head.params, path),
                                         {},
                                         {}});
}

absl::StatusOr<std::shared_ptr<const FilePayload>> FilePayload::Open(const std::string& path,
                                                                     const MapHead& head,
                                                                     ExpectedRows expected,
                                                                     const OpenOptions& options) {
  std::shared_ptr<FilePayload> payload(new FilePayload(
      head, std::move(expected), options.cache != nullptr ? options.cache : MakePayloadCache(0)));
  payload->path_ = path;
  for (int i = 0; i <= NumReaders(options); ++i) {
    ASSIGN_OR_RETURN(std::unique_ptr<Reader> reader, OpenReader(path, head));
    (i == 0 ? payload->scrubber_ : payload->idle_.emplace_back()) = std::move(reader);
  }
  return payload;
}

std::size_t FilePayload::PartOf(const PayloadId& id) const {
  if (id.part == PayloadId::Part::kStructure) return shapes_.size();
  return id.part == PayloadId::Part::kPolar ? id.variant : shapes_.size() - 1;
}

absl::StatusOr<std::shared_ptr<const Payload>> FilePayload::ReadRow(const PayloadId& id,
                                                                    Reader& reader) const {
  const std::size_t part = PartOf(id);
  const bool is_structure = part == shapes_.size();
  const std::int64_t place = id.place;
  const std::int64_t row_id = is_structure ? place
                                           : place * static_cast<std::int64_t>(shapes_.size()) +
                                                 static_cast<std::int64_t>(part);
  Statement& statement = is_structure ? reader.structure : reader.context;
  statement.Reset();
  statement.Bind(1, row_id);
  ASSIGN_OR_RETURN(const bool row, statement.Step());
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path_,
                        absl::StrCat(is_structure ? absl::StrCat("place ", place, ", structure")
                                                  : NameOf(shapes_[part], place),
                                     ": ", what));
  };
  if (!row) return damaged("its row is missing");
  auto payload = std::make_shared<Payload>();
  std::int64_t checksum = 0;
  absl::Status status;
  if (is_structure) {
    status = ReadStructureRow(statement, place, schema_version_, params_.automatic.posts.reach_m,
                              path_, reader.hasher, payload->structure, checksum);
  } else {
    status = ReadContextRow(statement, shapes_[part], place, row_id, path_, reader.hasher,
                            reader.values);
    checksum = reader.values.checksum;
    payload->cells_cm = reader.values.cells_cm;
    payload->aligning_cm = reader.values.aligning_cm;
  }
  statement.Reset();
  if (!status.ok()) return status;
  const std::size_t number = static_cast<std::size_t>(place) * num_parts() + part;
  if (static_cast<std::uint32_t>(checksum) != expected_.checksums[number]) {
    return damaged("it is not what it was when the map was opened");
  }
  return payload;
}

absl::Status FilePayload::BeginReading(const SearchControl& control, Reader& reader) const {
  const auto start = std::chrono::steady_clock::now();
  while (true) {
    // The first read takes the lock.
    absl::Status status = reader.connection.Execute(schema::kBeginRead);
    if (status.ok()) status = reader.connection.QueryInt(schema::kDataVersion).status();
    if (status.ok()) return status;
    status = Reclassified(status);
    (void)reader.connection.Execute(schema::kRollback);  // there may be none to undo
    const bool is_late = std::chrono::steady_clock::now() - start > kLongestCommit;
    if (!absl::IsUnavailable(status) || is_late) return status;
    if (control.IsUnwanted()) return Cancelled();
  }
}

// What was read stands, whatever ending the transaction says, as long as the next one can begin.
void FilePayload::EndReading(absl::Status& status, Reader& reader) {
  for (Statement* statement : {&reader.context, &reader.structure, &reader.keys}) {
    statement->Reset();
  }
  if (reader.bearings.has_value()) reader.bearings->Reset();
  status.Update(reader.connection.Execute(schema::kRollback));
}

absl::Status FilePayload::ReadRows(std::span<const PayloadId> ids,
                                   std::span<const std::size_t> missing,
                                   const SearchControl& control,
                                   std::vector<std::shared_ptr<const Payload>>& payloads) const {
  const Lease lease(*this, control);
  if (lease.get() == nullptr) return Cancelled();
  Reader& reader = *lease.get();
  RETURN_IF_ERROR(BeginReading(control, reader));
  absl::Status status;
  for (std::size_t n = 0; n < missing.size() && status.ok(); ++n) {
    const std::size_t i = missing[n];
    if (n % kRowsBetweenLooks == 0 && control.IsUnwanted()) {
      status = Cancelled();
    } else if (n % kRowsBetweenLooks == 0 && control.IsOver()) {
      break;
    } else {
      absl::StatusOr<std::shared_ptr<const Payload>> payload = ReadRow(ids[i], reader);
      status = payload.status();
      if (payload.ok()) payloads[i] = *std::move(payload);
    }
  }
  EndReading(status, reader);
  return Reclassified(status);
}

absl::Status FilePayload::Read(std::span<const PayloadId> ids, const SearchControl& control,
                               std::vector<std::shared_ptr<const Payload>>& payloads) const {
  std::vector<PayloadCache::Row> rows;
  rows.reserve(ids.size());
  for (const PayloadId& id : ids) {
    rows.push_back({number_, static_cast<std::uint64_t>(id.place) * num_parts() + PartOf(id)});
  }
  payloads = cache_->Find(rows);
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (payloads[i] == nullptr) missing.push_back(i);
  }
  if (missing.empty()) return absl::OkStatus();
  const std::span<const std::size_t> all(missing);
  const std::size_t num_first = missing.size() < kLeastForTwo ? missing.size() : missing.size() / 2;
  absl::Status status;
  absl::Status status_of_rest;
  const auto read_first = [&] { status = ReadRows(ids, all.first(num_first), control, payloads); };
  if (num_first == missing.size()) {
    read_first();
  } else {
    // No two threads write the same element.
    control.RunBoth(read_first, [&] {
      status_of_rest = ReadRows(ids, all.subspan(num_first), control, payloads);
    });
  }
  status.Update(status_of_rest);
  RETURN_IF_ERROR(status);
  for (const std::size_t i : missing) {
    if (payloads[i] != nullptr) cache_->Add(rows[i], payloads[i]);
  }
  return absl::OkStatus();
}

absl::Status FilePayload::ScrubBearings(std::int64_t place, const Structure& structure,
                                        Reader& reader) const {
  reader.bearings->Reset();
  reader.bearings->Bind(1, place);
  ASSIGN_OR_RETURN(const bool row, reader.bearings->Step());
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path_, absl::StrCat("bearings of place ", place, ": ", what));
  };
  if (!row) return damaged("their row is missing");
  const absl::StatusOr<BearingGrid> bearings =
      ReadBearingsRow(*reader.bearings, place, path_, reader.hasher);
  reader.bearings->Reset();
  if (!bearings.ok()) return bearings.status();
  if (*bearings != BearingsOf(structure.posts, params_)) {
    return damaged("they are not those of its structure");
  }
  return absl::OkStatus();
}

absl::Status FilePayload::ScrubPlace(std::int64_t place, Reader& reader) const {
  const auto damaged = [&](absl::string_view what) {
    return DamagedError(path_, absl::StrCat("keys of place ", place, ": ", what));
  };
  PlaceKeys keys;
  reader.keys.Reset();
  reader.keys.Bind(1, place);
  ASSIGN_OR_RETURN(const bool row, reader.keys.Step());
  if (!row) return damaged("their row is missing");
  absl::Status status = reader.keys_reader.Read(reader.keys, place, keys);
  reader.keys.Reset();
  if (!status.ok()) return status;
  const auto number = static_cast<std::int32_t>(place);
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    const bool is_polar = shapes_[i].kind == DescriptorKind::kPolar;
    const PayloadId id{number, is_polar ? PayloadId::Part::kPolar : PayloadId::Part::kCart,
                       static_cast<std::uint8_t>(shapes_[i].variant)};
    if (status = ReadRow(id, reader).status(); !status.ok()) return status;
    if (keys.retrieval_cm[i] != reader.values.retrieval_cm) {
      return damaged("they are not those of its contexts");
    }
  }
  if (!has_structures_) return absl::OkStatus();
  ASSIGN_OR_RETURN(const auto structure, ReadRow({number, PayloadId::Part::kStructure, 0}, reader));
  const Structure& read = structure->structure;
  if (keys.ground != PlaceGround{read.ground(), !read.posts.empty()}) {
    return damaged("their ground is not that of its structure");
  }
  return reader.bearings.has_value() ? ScrubBearings(place, read, reader) : absl::OkStatus();
}

absl::Status FilePayload::ScrubPlaces(std::size_t begin, std::size_t end, Reader& reader) const {
  absl::Status status = BeginReading({}, reader);
  for (std::size_t place = begin; place < end && status.ok(); ++place) {
    status = ScrubPlace(static_cast<std::int64_t>(place), reader);
  }
  EndReading(status, reader);
  return Reclassified(status);
}

absl::Status FilePayload::Scrub(const std::function<bool(std::size_t num_done)>& go_on) const {
  const std::lock_guard lock(scrub_mutex_);
  const std::size_t num_places = expected_.checksums.size() / std::max<std::size_t>(1, num_parts());
  int num_failed = 0;
  for (std::size_t done = 0; done < num_places;) {
    const std::size_t end = std::min(done + kScrubBatch, num_places);
    const absl::Status status = ScrubPlaces(done, end, *scrubber_);
    // A build that commits keeps it waiting.
    const bool may_try_again = absl::IsUnavailable(status) && ++num_failed < kMaxTries;
    if (!status.ok() && !may_try_again) return status;
    if (status.ok()) {
      done = end;
      num_failed = 0;
    }
    if (!go_on(done)) return absl::CancelledError("the check was stopped");
  }
  return absl::OkStatus();
}

}  // namespace scanloc::mapdb

#include "copy_places.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "folder.hpp"
#include "map_rows.hpp"
#include "map_writer.hpp"
#include "open_map.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/mapdb/geo_origin.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kCommitInterval = 1000;

void AddContext(const ContextShape& shape, const ContextValues& values,
                PlaceDescriptor& descriptor) {
  Context context{shape.num_rows, shape.num_cols, values.cells_cm};
  if (shape.kind == DescriptorKind::kPolar) {
    descriptor.polar.push_back(std::move(context));
  } else {
    descriptor.cart = std::move(context);
  }
}

absl::Status WrittenMeanwhile(const std::string& path) {
  return absl::UnavailableError(absl::StrCat("map '", path, "' was written meanwhile; try again"));
}

/// Writes the parts into a file, a session behind the other.
class Copier {
 public:
  explicit Copier(std::string output) : output_(std::move(output)) {}

  absl::Status Copy(const CopyPart& part) {
    ASSIGN_OR_RETURN(places_, part.places());
    next_ = 0;
    absl::Status visited = VisitDescriptors(
        part.source->path, [&](std::size_t place, const PlaceDescriptor& descriptor) {
          if (next_ == places_.size() || places_[next_].place != static_cast<std::int64_t>(place)) {
            return absl::OkStatus();
          }
          return Add(part.source->info.params, descriptor);
        });
    if (!visited.ok()) return visited;
    return next_ == places_.size() ? absl::OkStatus() : WrittenMeanwhile(part.source->path);
  }

  absl::StatusOr<std::string> Finish() {
    RETURN_IF_ERROR(EndSession());
    if (content_id_.empty()) return absl::InvalidArgumentError("the new map would have no place");
    return content_id_;
  }

 private:
  absl::Status Add(const Params& params, const PlaceDescriptor& descriptor) {
    const std::string& session = places_[next_].session;
    if (!builder_ || builder_->plan().name != session || num_added_ == num_planned_) {
      RETURN_IF_ERROR(StartSession(params));
    }
    absl::Status status = builder_->Add(descriptor);
    ++next_;
    if (status.ok() && ++num_added_ % kCommitInterval == 0) status = builder_->Commit();
    return status;
  }

  /// All that follow with the same name are of the session.
  absl::Status StartSession(const Params& params) {
    RETURN_IF_ERROR(EndSession());
    SessionPlan plan{.name = places_[next_].session, .scans = {}};
    for (std::size_t i = next_; i < places_.size() && places_[i].session == plan.name; ++i) {
      plan.scans.push_back(std::move(places_[i].scan));
    }
    num_planned_ = plan.scans.size();
    num_added_ = 0;
    ASSIGN_OR_RETURN(builder_, content_id_.empty()
                                   ? MapBuilder::Create(output_, params, std::move(plan))
                                   : MapBuilder::Append(output_, std::move(plan)));
    return absl::OkStatus();
  }

  absl::Status EndSession() {
    if (!builder_) return absl::OkStatus();
    absl::StatusOr<std::string> id = builder_->Finish();
    builder_.reset();
    if (!id.ok()) return id.status();
    content_id_ = *std::move(id);
    return absl::OkStatus();
  }

  std::string output_;
  std::optional<MapBuilder> builder_;
  std::size_t num_planned_ = 0;  // of the session
  std::size_t num_added_ = 0;
  std::vector<CopiedPlace> places_;  // of the part
  std::size_t next_ = 0;             // of these
  std::string content_id_;
};

std::vector<HistoryEntry> HistoryOf(const std::vector<CopyPart>& parts, HistoryEntry made_by) {
  std::vector<HistoryEntry> history;
  for (const CopyPart& part : parts) {
    const std::vector<HistoryEntry>& inherited = part.source->info.history;
    history.insert(history.end(), inherited.begin(), inherited.end());
    made_by.parents.push_back(part.source->info.content_id);
  }
  if (!made_by.command.empty()) history.push_back(std::move(made_by));
  return history;
}

/// That of the parts that have one, which must be one.
absl::StatusOr<std::optional<GeoOrigin>> GeoOriginOf(const std::vector<CopyPart>& parts) {
  const CopySource* told = nullptr;
  for (const CopyPart& part : parts) {
    if (!part.source->info.geo_origin) continue;
    if (told != nullptr && part.source->info.geo_origin != told->info.geo_origin) {
      return absl::FailedPreconditionError(
          absl::StrCat("maps '", told->path, "' and '", part.source->path,
                       "' have different geo origins: maps that are put together share one frame; "
                       "give one of them that of the other (scanloc edit --geo-origin)"));
    }
    told = part.source;
  }
  return told == nullptr ? std::nullopt : told->info.geo_origin;
}

void RemovePartial(const std::string& path) {
  unlink(path.c_str());
  unlink(absl::StrCat(path, "-journal").c_str());
}

absl::StatusOr<std::string> WriteParts(const std::string& path, const std::vector<CopyPart>& parts,
                                       const std::vector<HistoryEntry>& history) {
  ASSIGN_OR_RETURN(const std::optional<GeoOrigin> geo_origin, GeoOriginOf(parts));
  Copier copier(path);
  for (const CopyPart& part : parts) {
    RETURN_IF_ERROR(copier.Copy(part));
  }
  absl::StatusOr<std::string> content_id = copier.Finish();
  if (!content_id.ok()) return content_id;
  ASSIGN_OR_RETURN(MapWriter writer, MapWriter::Open(path));
  absl::Status status;
  if (!history.empty()) status = writer.SetMeta(schema::kHistoryKey, EncodeHistory(history));
  if (status.ok() && geo_origin) {
    status = writer.SetMeta(schema::kGeoOriginKey, EncodeGeoOrigin(*geo_origin));
  }
  if (status.ok()) status = writer.Release();
  if (!status.ok()) return status;
  return content_id;
}

}  // namespace

absl::Status VisitDescriptors(
    const std::string& path,
    const std::function<absl::Status(std::size_t place, const PlaceDescriptor&)>& visit) {
  ASSIGN_OR_RETURN(Connection connection, OpenForReading(path));
  ASSIGN_OR_RETURN(const MapHead head, ReadHead(connection));
  std::vector<PlaceRow> places;
  const absl::StatusOr<ContentHasher> content =
      VisitPlaces(connection, head, [&](const PlaceRow& row) {
        places.push_back(row);
        return absl::OkStatus();
      });
  if (!content.ok()) return content.status();
  ASSIGN_OR_RETURN(DescriptorReader descriptors, DescriptorReader::Open(connection, head));
  for (std::size_t i = 0; i < places.size(); ++i) {
    PlaceDescriptor descriptor;
    descriptor.num_voxels = static_cast<std::uint32_t>(places[i].num_voxels);
    absl::Status status =
        descriptors.Read(places[i], [&](const ContextShape& shape, const ContextValues& values) {
          AddContext(shape, values, descriptor);
        });
    if (!status.ok()) return status;
    if (descriptors.has_structures()) descriptor.structure = descriptors.structure();
    if (status = visit(i, descriptor); !status.ok()) return status;
  }
  return absl::OkStatus();
}

std::string FreeName(const std::string& name, const std::set<std::string>& taken) {
  std::string free = name;
  for (int i = 2; taken.contains(free); ++i) free = absl::StrCat(name, "-", i);
  return free;
}

absl::Status CheckIsNew(const std::string& path) {
  struct stat info = {};
  if (lstat(path.c_str(), &info) != 0) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("there is a file '", path, "' already; remove it or choose another name"));
}

absl::StatusOr<CopySource> ReadSource(const std::string& path) {
  ASSIGN_OR_RETURN(FileInfo info, ReadInfo(path));
  if (!info.complete) {
    return absl::FailedPreconditionError(
        absl::StrCat("map '", path, "' is incomplete; finish its build with --resume first"));
  }
  return CopySource{path, std::move(info)};
}

absl::StatusOr<std::vector<CopiedPlace>> AllPlaces(const CopySource& source) {
  ASSIGN_OR_RETURN(std::vector<PlaceRecord> records, ReadPlaces(source.path));
  if (records.size() != static_cast<std::size_t>(source.info.num_places)) {
    return WrittenMeanwhile(source.path);
  }
  std::vector<CopiedPlace> copied;
  copied.reserve(records.size());
  for (PlaceRecord& record : records) {
    const auto session = static_cast<std::size_t>(record.place.session);
    if (session >= source.info.sessions.size()) return WrittenMeanwhile(source.path);
    copied.push_back({static_cast<std::int64_t>(copied.size()),
                      source.info.sessions[session].name,
                      {std::move(record.scan), record.place.stamp_ns, record.place.T_map_place}});
  }
  return copied;
}

CopyPart PartOf(const CopySource& source, std::vector<CopiedPlace> places) {
  return {&source, [places = std::move(places)] { return places; }};
}

absl::StatusOr<std::string> WriteCopy(const std::string& out, const std::vector<CopyPart>& parts,
                                      HistoryEntry made_by, const Finish& finish) {
  RETURN_IF_ERROR(CheckIsNew(out));
  for (const CopyPart& part : parts) {
    const CopySource& first = *parts.front().source;
    if (const std::string difference =
            DescribeDifference(part.source->info.params, first.info.params);
        !difference.empty()) {
      return absl::FailedPreconditionError(
          absl::StrCat("map '", part.source->path, "' has other parameters than '", first.path,
                       "': ", difference, "; build one of them again"));
    }
  }
  const std::string partial = absl::StrCat(out, ".partial-", getpid());
  RemovePartial(partial);  // of a process that was killed, and had the same number
  for (const char* kind : {".partial-", ".fresh-"}) RemoveLeftBehind(absl::StrCat(out, kind));
  absl::StatusOr<std::string> content_id =
      WriteParts(partial, parts, HistoryOf(parts, std::move(made_by)));
  absl::Status status = content_id.status();
  if (status.ok() && finish) status = finish(partial);
  if (status.ok()) status = RenameNew(partial, out);
  if (!status.ok()) content_id = status;
  if (content_id.ok()) return content_id;
  RemovePartial(partial);
  return absl::Status(
      content_id.status().code(),
      absl::StrReplaceAll(content_id.status().message(),
                          {{partial, out}, {kResumeAdvice, "; nothing is kept of it: make room"}}));
}

}  // namespace scanloc::mapdb

#include "scanloc/mapdb/merge_maps.hpp"

#include <unistd.h>

#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "folder.hpp"
#include "map_rows.hpp"
#include "open_map.hpp"
#include "scanloc/mapdb/map_builder.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kCommitInterval = 1000;

// What the sessions of an input are to be named.
using SessionNames = std::vector<std::string>;

std::string FreeName(const std::string& name, const std::set<std::string>& taken) {
  std::string free = name;
  for (int i = 2; taken.contains(free); ++i) free = absl::StrCat(name, "-", i);
  return free;
}

// The names of the sessions of each input, if they can all stand in one map.
absl::StatusOr<std::vector<SessionNames>> CheckCanMerge(const std::vector<std::string>& inputs,
                                                        bool rename_sessions) {
  std::vector<SessionNames> names_of;
  if (inputs.empty()) return absl::InvalidArgumentError("there is no map to merge; name some");
  Params params;
  std::set<std::string> names;
  std::int64_t num_places = 0;
  for (const std::string& path : inputs) {
    absl::StatusOr<Connection> connection = OpenForReading(path);
    if (!connection.ok()) return connection.status();
    const absl::StatusOr<MapHead> head = ReadHead(*connection);
    if (!head.ok()) return head.status();
    if (!head->complete()) {
      return absl::FailedPreconditionError(
          absl::StrCat("map '", path, "' is incomplete; finish its build with --resume first"));
    }
    if (&path == &inputs.front()) params = head->params;
    if (const std::string difference = DescribeDifference(head->params, params);
        !difference.empty()) {
      return absl::FailedPreconditionError(
          absl::StrCat("map '", path, "' has other parameters than '", inputs.front(),
                       "': ", difference, "; build one of them again"));
    }
    names_of.emplace_back();
    for (const SessionRow& session : head->sessions) {
      const std::string name = rename_sessions ? FreeName(session.name, names) : session.name;
      if (!names.insert(name).second) {
        return absl::FailedPreconditionError(
            absl::StrCat("map '", path, "' has a session '", session.name,
                         "', and an earlier map, too; merge them with --rename-sessions"));
      }
      names_of.back().push_back(name);
    }
    num_places += head->num_places();
  }
  if (num_places == 0) return absl::InvalidArgumentError("none of the maps to merge has a place");
  return names_of;
}

SessionPlan PlanOf(const SessionRow& session, const std::string& name,
                   std::vector<PlaceRow>::const_iterator first) {
  SessionPlan plan;
  plan.name = name;
  for (auto row = first; row != first + session.num_places; ++row) {
    plan.scans.push_back({row->scan, row->stamp_ns, DecodePose(row->pose)});
  }
  return plan;
}

void AddContext(const ContextShape& shape, const ContextValues& values,
                PlaceDescriptor& descriptor) {
  Context context{shape.num_rows, shape.num_cols, values.cells_cm};
  if (shape.kind == DescriptorKind::kPolar) {
    descriptor.polar.push_back(std::move(context));
  } else {
    descriptor.cart = std::move(context);
  }
}

// Reads one input and writes its sessions behind those that the output has.
class MapCopier {
 public:
  MapCopier(std::string input, const SessionNames& names, std::string output)
      : input_(std::move(input)), names_(names), output_(std::move(output)) {}

  absl::Status Copy(bool& is_started, std::string& content_id) {
    absl::StatusOr<Connection> connection = OpenForReading(input_);
    if (!connection.ok()) return connection.status();
    const absl::StatusOr<MapHead> head = ReadHead(*connection);
    if (!head.ok()) return head.status();
    std::vector<PlaceRow> places;
    const absl::StatusOr<ContentHasher> content =
        VisitPlaces(*connection, *head, [&](const PlaceRow& row) {
          places.push_back(row);
          return absl::OkStatus();
        });
    if (!content.ok()) return content.status();
    absl::StatusOr<DescriptorReader> descriptors = DescriptorReader::Open(*connection, *head);
    if (!descriptors.ok()) return descriptors.status();

    auto first = places.cbegin();
    for (std::size_t i = 0; i < head->sessions.size(); ++i) {
      const SessionRow& session = head->sessions[i];
      if (i == names_.size()) break;  // it has grown since
      if (session.num_places == 0) continue;
      SessionPlan plan = PlanOf(session, names_[i], first);
      absl::StatusOr<MapBuilder> builder =
          is_started ? MapBuilder::Append(output_, std::move(plan))
                     : MapBuilder::Create(output_, head->params, std::move(plan));
      if (!builder.ok()) return builder.status();
      is_started = true;
      if (absl::Status status = CopyPlaces(first, *descriptors, *builder); !status.ok())
        return status;
      absl::StatusOr<std::string> id = builder->Finish();
      if (!id.ok()) return id.status();
      content_id = *std::move(id);
      first += session.num_places;
    }
    return absl::OkStatus();
  }

 private:
  absl::Status CopyPlaces(std::vector<PlaceRow>::const_iterator row, DescriptorReader& descriptors,
                          MapBuilder& builder) {
    for (std::size_t i = 0; i < builder.plan().scans.size(); ++i, ++row) {
      PlaceDescriptor descriptor;
      descriptor.num_voxels = static_cast<std::uint32_t>(row->num_voxels);
      absl::Status status =
          descriptors.Read(*row, [&](const ContextShape& shape, const ContextValues& values) {
            AddContext(shape, values, descriptor);
          });
      if (status.ok() && descriptors.has_structures())
        descriptor.structure = descriptors.structure();
      if (status.ok()) status = builder.Add(descriptor);
      if (status.ok() && (i + 1) % kCommitInterval == 0) status = builder.Commit();
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  std::string input_;
  const SessionNames& names_;
  std::string output_;
};

absl::StatusOr<std::string> CopyAll(const std::vector<std::string>& inputs,
                                    const std::vector<SessionNames>& names_of,
                                    const std::string& output) {
  bool is_started = false;
  std::string content_id;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    absl::Status status = MapCopier(inputs[i], names_of[i], output).Copy(is_started, content_id);
    if (!status.ok()) return status;
  }
  return content_id;
}

}  // namespace

// The output's name is taken by an empty file at once, and gets its content in one step at the end:
// a merge that is killed leaves nothing that looks like a whole map.
absl::StatusOr<std::string> MergeMaps(const std::string& out,
                                      const std::vector<std::string>& inputs,
                                      bool rename_sessions) {
  const absl::StatusOr<std::vector<SessionNames>> names_of = CheckCanMerge(inputs, rename_sessions);
  if (!names_of.ok()) return names_of.status();
  if (absl::Status status = CreateEmptyFile(out); !status.ok()) return status;
  const std::string partial = absl::StrCat(out, ".merging-", getpid());
  absl::StatusOr<std::string> content_id = CopyAll(inputs, *names_of, partial);
  if (content_id.ok()) {
    if (absl::Status status = RenameFile(partial, out); !status.ok()) content_id = status;
  }
  if (!content_id.ok()) {
    unlink(partial.c_str());
    unlink(out.c_str());
  }
  return content_id;
}

}  // namespace scanloc::mapdb

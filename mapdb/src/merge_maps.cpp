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

// OK if the sessions of all inputs can stand in one map.
absl::Status CheckCanMerge(const std::vector<std::string>& inputs) {
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
    for (const SessionRow& session : head->sessions) {
      if (!names.insert(session.name).second) {
        return absl::FailedPreconditionError(
            absl::StrCat("map '", path, "' has a session '", session.name,
                         "', and an earlier map, too; build it again with another --session"));
      }
    }
    num_places += head->num_places();
  }
  return num_places > 0 ? absl::OkStatus()
                        : absl::InvalidArgumentError("none of the maps to merge has a place");
}

SessionPlan PlanOf(const SessionRow& session, std::vector<PlaceRow>::const_iterator first) {
  SessionPlan plan;
  plan.name = session.name;
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
  MapCopier(std::string input, std::string output)
      : input_(std::move(input)), output_(std::move(output)) {}

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
    absl::StatusOr<DescriptorReader> descriptors =
        DescriptorReader::Open(*connection, head->params);
    if (!descriptors.ok()) return descriptors.status();

    auto first = places.cbegin();
    for (const SessionRow& session : head->sessions) {
      if (session.num_places == 0) continue;
      SessionPlan plan = PlanOf(session, first);
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
  std::string output_;
};

absl::StatusOr<std::string> CopyAll(const std::vector<std::string>& inputs,
                                    const std::string& output) {
  bool is_started = false;
  std::string content_id;
  for (const std::string& input : inputs) {
    if (absl::Status status = MapCopier(input, output).Copy(is_started, content_id); !status.ok()) {
      return status;
    }
  }
  return content_id;
}

}  // namespace

// The output's name is taken by an empty file at once, and gets its content in one step at the end:
// a merge that is killed leaves nothing that looks like a whole map.
absl::StatusOr<std::string> MergeMaps(const std::string& out,
                                      const std::vector<std::string>& inputs) {
  if (absl::Status status = CheckCanMerge(inputs); !status.ok()) return status;
  if (absl::Status status = CreateEmptyFile(out); !status.ok()) return status;
  const std::string partial = absl::StrCat(out, ".merging-", getpid());
  absl::StatusOr<std::string> content_id = CopyAll(inputs, partial);
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

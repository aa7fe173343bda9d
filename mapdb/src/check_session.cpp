#include "scanloc/mapdb/check_session.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/localizer.hpp"
#include "scanloc/core/map/spacing.hpp"
#include "scanloc/core/median.hpp"
#include "scanloc/core/scan/pose_difference.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/structural/consistency.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::mapdb {
namespace {

constexpr std::size_t kMaxPairs = 40;
constexpr std::size_t kMaxQueries = 40;
/// Of all maps that are merged together; each has its least, however many there are.
constexpr std::size_t kMaxQueriesOfParts = 200;
constexpr std::size_t kLeastQueriesOfPart = 5;
/// Answers that must have been found before they are believed against the poses.
constexpr std::size_t kMinFound = 3;
/// So many that contradict, and more than a quarter, are no chance: a part of the drive has
/// slipped.
constexpr std::size_t kSlipped = 4;

/// The descriptor of a scan; none if it cannot be read.
absl::StatusOr<std::optional<ScanDescriptor>> Look(const ScanLoader& load_scan, std::size_t scan,
                                                   Describer& describer) {
  const absl::StatusOr<PointCloud> points = load_scan(scan);
  if (absl::IsCancelled(points.status())) return points.status();
  if (!points.ok()) return std::optional<ScanDescriptor>();
  return std::optional(describer.Describe(*points));
}

std::string Motion(const Pose& pose) {
  const PoseDifference difference = DifferenceOf(Pose::Identity(), pose);
  return absl::StrFormat("%.2f m and %.1f deg", pose.translation().norm(), difference.heading_deg);
}

/// Scans of neighbouring places; where nearly all stand at one, as where kilometres are taken for
/// metres, scans that follow each other closely.
std::vector<std::pair<std::size_t, std::size_t>> ScansToCompare(const std::vector<Pose>& poses,
                                                                double spacing_m) {
  constexpr std::size_t kFewPlaces = 3;
  constexpr std::size_t kSteps[] = {1, 2, 4};
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  const std::vector<std::size_t> places = SelectBySpacing(poses, spacing_m);
  if (places.size() <= kFewPlaces) {
    const std::size_t stride = std::max<std::size_t>(1, poses.size() / kMaxPairs);
    for (std::size_t k = 0; k < kMaxPairs; ++k) {
      const std::size_t first = k * stride;
      const std::size_t second = first + kSteps[k % std::size(kSteps)];
      if (second < poses.size()) pairs.emplace_back(first, second);
    }
    return pairs;
  }
  std::vector<Pose> at_places;
  at_places.reserve(places.size());
  for (const std::size_t i : places) at_places.push_back(poses[i]);
  for (const std::size_t i : PairsToCheck(at_places, kMaxPairs)) {
    pairs.emplace_back(places[i], places[i + 1]);
  }
  return pairs;
}

/// None if its scans have no structure to be localized by, or it has no place.
absl::StatusOr<std::shared_ptr<const Localizer>> OpenLocalizer(const std::string& map_path) {
  ASSIGN_OR_RETURN(Map map, OpenMap(map_path));
  if (!map.params.structure.enabled || map.places.empty()) return nullptr;
  return Localizer::CreateFor(std::make_shared<const Map>(std::move(map)),
                              Method{.automatic = true});
}

/// What became of queries whose poses are told.
class FrameTally {
 public:
  void Add(const Answer& answer, const Pose& T_map_told) {
    if (answer.outcome != Outcome::kLocalized) return;
    ++num_found_;
    const PoseDifference difference =
        DifferenceOf(answer.candidates.front().T_map_query, T_map_told);
    if (!MissOf(difference).any()) return;
    planes_m_.push_back(difference.plane_m);
    heights_m_.push_back(difference.height_m);
    headings_deg_.push_back(difference.heading_deg);
  }
  [[nodiscard]] bool disagrees() const {
    const std::size_t num_elsewhere = planes_m_.size();
    return (num_found_ >= kMinFound && num_elsewhere * 2 > num_found_) ||
           (num_elsewhere >= kSlipped && num_elsewhere * 4 > num_found_);
  }
  [[nodiscard]] std::string Text() const {
    return absl::StrFormat(
        "%d are found in the map, %d of them elsewhere than their poses say, by %.2f m in the "
        "plane, %.2f m in height and %.1f deg (medians)",
        num_found_, planes_m_.size(), Median(planes_m_), Median(heights_m_), Median(headings_deg_));
  }

 private:
  std::size_t num_found_ = 0;
  std::vector<double> planes_m_;
  std::vector<double> heights_m_;
  std::vector<double> headings_deg_;
};

std::size_t SessionOf(const Map& map, std::size_t place) {
  return static_cast<std::size_t>(map.places[place].session);
}

/// One of the maps that a merged one is made of.
struct Part {
  std::size_t begin = 0;  ///< place
  std::size_t end = 0;
  std::size_t num_queries = 0;
  std::size_t num_asked = 0;
  Query elsewhere;  ///< in the sessions of the other parts
  FrameTally tally;

  /// The place to ask about next; `end` after the last.
  [[nodiscard]] std::size_t NextQuery() const {
    return num_asked == num_queries ? end : begin + num_asked * (end - begin) / num_queries;
  }
};

std::vector<Part> PartsOf(const Map& map, const std::vector<std::int64_t>& num_places) {
  const std::size_t most =
      std::clamp(kMaxQueriesOfParts / std::max<std::size_t>(1, num_places.size()),
                 kLeastQueriesOfPart, kMaxQueries);
  std::vector<Part> parts;
  std::size_t begin = 0;
  for (const std::int64_t num : num_places) {
    Part part{.begin = begin,
              .end = std::min(begin + static_cast<std::size_t>(num), map.places.size())};
    std::vector<bool> is_own(map.sessions.size());
    for (std::size_t i = part.begin; i < part.end; ++i) is_own[SessionOf(map, i)] = true;
    std::vector<std::string>& others = part.elsewhere.prior.sessions;
    for (std::size_t i = 0; i < map.sessions.size(); ++i) {
      if (!is_own[i]) others.push_back(map.sessions[i]);
    }
    if (!others.empty() && others.size() <= limits::kMaxPriorSessions) {
      part.num_queries = std::min(part.end - part.begin, most);
    }
    begin = part.end;
    parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace

absl::Status CheckPoses(const Params& params, const SessionPlan& drive, double spacing_m,
                        const ScanLoader& load_scan) {
  if (!params.structure.enabled) return absl::OkStatus();
  ASSIGN_OR_RETURN(Describer describer, Describer::Create(params));
  std::vector<Pose> poses;
  poses.reserve(drive.scans.size());
  for (const PlannedScan& scan : drive.scans) poses.push_back(scan.T_map_place);

  std::vector<PairCheck> checks;
  for (const auto& [i, k] : ScansToCompare(poses, spacing_m)) {
    ASSIGN_OR_RETURN(std::optional<ScanDescriptor> first, Look(load_scan, i, describer));
    ASSIGN_OR_RETURN(std::optional<ScanDescriptor> second, Look(load_scan, k, describer));
    if (!first || !second) continue;
    checks.push_back(CheckPair({i, k, std::move(first->structure), std::move(second->structure)},
                               poses[i], poses[k], params.automatic));
  }
  const ConsistencyReport report = JudgeDrive(checks, poses);
  if (!report.is_inconsistent) return absl::OkStatus();
  const PairCheck& worst =
      *std::ranges::max_element(checks, [](const PairCheck& a, const PairCheck& b) {
        const auto weight = [](const PairCheck& c) {
          return c.verdict == PairCheck::Verdict::kContradicts ? c.score : 0.0;
        };
        return weight(a) < weight(b);
      });
  std::string example;
  if (worst.verdict == PairCheck::Verdict::kContradicts) {
    example = absl::StrFormat(
        "; for example '%s' and '%s' are %s apart by their poses, %s by what they show",
        drive.scans[worst.first].name, drive.scans[worst.second].name, Motion(worst.told),
        Motion(worst.shown));
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "the poses contradict the scans: of %d pairs of neighbouring scans %d lie on each other "
      "elsewhere than their poses say, by a metre or 10 deg and more, and %d do not look alike "
      "though the poses put them side by side%s. Likely cause: %s",
      checks.size(), report.num_contradicting, report.num_strangers, example, report.likely_cause));
}

absl::Status CheckFrame(const std::string& map_path, const SessionPlan& plan,
                        const ScanLoader& load_scan) {
  ASSIGN_OR_RETURN(const std::shared_ptr<const Localizer> localizer, OpenLocalizer(map_path));
  if (localizer == nullptr) return absl::OkStatus();
  ASSIGN_OR_RETURN(Describer describer, Describer::Create(localizer->map().params));

  FrameTally tally;
  const std::size_t num_queries = std::min(plan.scans.size(), kMaxQueries);
  for (std::size_t k = 0; k < num_queries; ++k) {
    const std::size_t i = k * plan.scans.size() / num_queries;
    ASSIGN_OR_RETURN(const std::optional<ScanDescriptor> scan, Look(load_scan, i, describer));
    if (!scan) continue;
    ASSIGN_OR_RETURN(const Answer answer, localizer->Localize(*scan));
    tally.Add(answer, plan.scans[i].T_map_place);
  }
  if (!tally.disagrees()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("the same places are found in both drives, but their poses disagree: of %d "
                      "scans of this drive %s. Bring the drive into the map's frame first",
                      num_queries, tally.Text()));
}

absl::Status CheckParts(const std::string& map_path, const std::vector<std::int64_t>& num_places) {
  ASSIGN_OR_RETURN(const std::shared_ptr<const Localizer> localizer, OpenLocalizer(map_path));
  if (localizer == nullptr) return absl::OkStatus();
  const Map& map = localizer->map();
  std::vector<Part> parts = PartsOf(map, num_places);
  auto part = parts.begin();
  absl::Status status =
      VisitDescriptors(map_path, [&](std::size_t place, const PlaceDescriptor& descriptor) {
        while (part != parts.end() && place >= part->end) ++part;
        if (part == parts.end() || place != part->NextQuery()) return absl::OkStatus();
        ++part->num_asked;
        ASSIGN_OR_RETURN(const Answer answer,
                         localizer->Localize(QueryOf(descriptor), part->elsewhere));
        part->tally.Add(answer, map.places[place].T_map_place);
        return absl::OkStatus();
      });
  if (!status.ok()) return status;
  for (const Part& checked : parts) {
    if (!checked.tally.disagrees()) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "the same places are in several of the maps, but their poses disagree: of %d places of "
        "session '%s' on %s. Bring the maps into one frame first",
        checked.num_asked, map.sessions[SessionOf(map, checked.begin)], checked.tally.Text()));
  }
  return absl::OkStatus();
}

}  // namespace scanloc::mapdb

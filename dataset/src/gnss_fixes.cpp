#include "scanloc/dataset/gnss_fixes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "decimal_time.hpp"
#include "file_bytes.hpp"
#include "pose_rows.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::int64_t kMaxGap_ns = 2'000'000'000;

bool IsBag(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return true;
  return std::ranges::any_of(std::array{".mcap", ".db3", ".bag", ".zstd"},
                             [&](const char* ending) { return absl::EndsWith(path, ending); });
}

absl::StatusOr<std::vector<GnssFix>> FromBag(const std::string& path) {
  ASSIGN_OR_RETURN(const auto bag, Bag::Open({path}));
  std::vector<const BagTopic*> topics;
  for (const BagTopic& topic : bag->topics()) {
    if (topic.type == kFixType) topics.push_back(&topic);
  }
  std::vector<GnssFix> fixes;
  const absl::Status status = bag->ForEach(topics, [&](const BagMessage& message) {
    const auto fix = DecodeFix(message.topic->format, message.bytes);
    if (fix.ok() && *fix) fixes.push_back(**fix);
    return Annotate(fix.status(), absl::StrCat(path, ": ", message.topic->name));
  });
  if (!status.ok()) return status;
  return fixes;
}

/// The columns of stamp, latitude, longitude and altitude.
absl::StatusOr<std::array<std::size_t, 4>> ColumnsOf(const Tokens& header) {
  constexpr std::array<const char*, 4> kNames = {"stamp", "latitude", "longitude", "altitude"};
  std::array<std::size_t, 4> columns = {};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto found = std::ranges::find(header, kNames[i]);
    if (found == header.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "its first line names no column ", kNames[i], "; ", absl::StrJoin(kNames, ", "),
          " are needed: stamps in s, ms, us or ns, degrees, and metres above the ellipsoid"));
    }
    columns[i] = static_cast<std::size_t>(found - header.begin());
  }
  return columns;
}

absl::StatusOr<std::vector<GnssFix>> FromCsv(const std::string& path) {
  std::optional<std::array<std::size_t, 4>> columns;
  TimeUnit unit = TimeUnit::kSeconds;
  std::vector<GnssFix> fixes;
  const absl::Status status =
      ForEachRow(path, BlankLines::kSkip, [&](const TextRow& row) -> absl::Status {
        if (!columns) {
          ASSIGN_OR_RETURN(columns, ColumnsOf(row.values));
          return absl::OkStatus();
        }
        if (row.values.size() > std::ranges::max(*columns)) {
          const auto value = [&](std::size_t i) { return row.values[(*columns)[i]]; };
          if (fixes.empty()) unit = LikelyUnit(value(0));
          const std::optional<std::int64_t> stamp_ns = ParseTimeAsNs(value(0), unit);
          GnssFix fix{.stamp_ns = stamp_ns.value_or(0)};
          if (stamp_ns && absl::SimpleAtod(ToAbsl(value(1)), &fix.latitude_deg) &&
              absl::SimpleAtod(ToAbsl(value(2)), &fix.longitude_deg) &&
              absl::SimpleAtod(ToAbsl(value(3)), &fix.altitude_m)) {
            fixes.push_back(fix);
            return absl::OkStatus();
          }
        }
        return Invalid(absl::StrCat("does not hold stamp [", ToAbsl(TimeUnitName(unit)),
                                    "], latitude, longitude and altitude as numbers"));
      });
  if (!status.ok()) return status;
  return fixes;
}

}  // namespace

absl::StatusOr<std::vector<GnssFix>> ReadGnssFixes(const std::string& path) {
  ASSIGN_OR_RETURN(std::vector<GnssFix> fixes, IsBag(path) ? FromBag(path) : FromCsv(path));
  std::erase_if(fixes, [](const GnssFix& fix) {
    return !(std::abs(fix.latitude_deg) <= 90.0) || !(std::abs(fix.longitude_deg) <= 360.0) ||
           !std::isfinite(fix.altitude_m);
  });
  if (fixes.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": holds no fix", IsBag(path) ? " (sensor_msgs/NavSatFix)" : ""));
  }
  std::ranges::stable_sort(fixes, {}, &GnssFix::stamp_ns);
  return fixes;
}

std::optional<GnssFix> FixAt(std::span<const GnssFix> fixes, std::int64_t stamp_ns) {
  const auto after = std::ranges::lower_bound(fixes, stamp_ns, {}, &GnssFix::stamp_ns);
  if (after == fixes.end()) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return *after;
  if (after == fixes.begin()) return std::nullopt;
  const GnssFix& before = *std::prev(after);
  const std::int64_t gap_ns = after->stamp_ns - before.stamp_ns;
  if (gap_ns > kMaxGap_ns) return std::nullopt;
  const double share =
      static_cast<double>(stamp_ns - before.stamp_ns) / static_cast<double>(gap_ns);
  // Across the date line there is no between.
  if (std::abs(after->longitude_deg - before.longitude_deg) > 180.0) return std::nullopt;
  return GnssFix{stamp_ns, std::lerp(before.latitude_deg, after->latitude_deg, share),
                 std::lerp(before.longitude_deg, after->longitude_deg, share),
                 std::lerp(before.altitude_m, after->altitude_m, share)};
}

}  // namespace scanloc::dataset

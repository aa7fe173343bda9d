#include "scanloc/dataset/gnss_fixes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "decimal_time.hpp"
#include "file_bytes.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/bag.hpp"
#include "scanloc/dataset/ros_messages.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::int64_t kMaxFileBytes = std::int64_t{1} << 30;
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

std::vector<absl::string_view> FieldsOf(std::string_view line) {
  std::vector<absl::string_view> fields = absl::StrSplit(ToAbsl(line), ',');
  for (absl::string_view& field : fields) field = absl::StripAsciiWhitespace(field);
  return fields;
}

/// The columns of stamp, latitude, longitude and altitude.
absl::StatusOr<std::array<std::size_t, 4>> ColumnsOf(std::string_view header) {
  constexpr std::array<absl::string_view, 4> kNames = {"stamp", "latitude", "longitude",
                                                       "altitude"};
  const std::vector<absl::string_view> fields = FieldsOf(header);
  std::array<std::size_t, 4> columns = {};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto found = std::ranges::find(fields, kNames[i]);
    if (found == fields.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "its first line names no column ", kNames[i], "; ", absl::StrJoin(kNames, ", "),
          " are needed: stamps in seconds, degrees, and metres above the ellipsoid"));
    }
    columns[i] = static_cast<std::size_t>(found - fields.begin());
  }
  return columns;
}

absl::StatusOr<std::vector<GnssFix>> FromCsv(const std::string& path) {
  ASSIGN_OR_RETURN(const FileBytes bytes, ReadFileBytes(path, kMaxFileBytes));
  LineReader lines(bytes.view());
  const std::optional<std::string_view> header = lines.Next();
  const auto columns = ColumnsOf(header.value_or(""));
  if (!columns.ok()) return Annotate(columns.status(), path);
  std::vector<GnssFix> fixes;
  while (const std::optional<std::string_view> line = lines.Next()) {
    const std::vector<absl::string_view> fields = FieldsOf(*line);
    if (fields.size() == 1 && fields[0].empty()) continue;
    GnssFix fix;
    bool is_good = *std::ranges::max_element(*columns) < fields.size();
    if (is_good) {
      const absl::string_view stamp = fields[(*columns)[0]];
      const auto stamp_ns = ParseTimeAsNs({stamp.data(), stamp.size()});
      is_good = stamp_ns && absl::SimpleAtod(fields[(*columns)[1]], &fix.latitude_deg) &&
                absl::SimpleAtod(fields[(*columns)[2]], &fix.longitude_deg) &&
                absl::SimpleAtod(fields[(*columns)[3]], &fix.altitude_m);
      fix.stamp_ns = stamp_ns.value_or(0);
    }
    if (!is_good) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": line ", lines.line_number(),
                       " does not hold stamp, latitude, longitude and ", "altitude as numbers"));
    }
    fixes.push_back(fix);
  }
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

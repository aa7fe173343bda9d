#include "quaternion_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "pose_format.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {
namespace {

// In small letters, without quotes, "%" (a recorded topic's), and the unit in brackets.
std::string Normalise(std::string_view name) {
  std::string text = absl::AsciiStrToLower(ToAbsl(name.substr(0, name.find_first_of("[("))));
  std::erase_if(text, [](char c) { return c == '"' || c == '\'' || c == '%' || c == ' '; });
  return text;
}

bool IsOneOf(const std::string& name, std::initializer_list<std::string_view> names) {
  return std::ranges::find(names, name) != names.end();
}

bool IsQuaternion(const std::string& name) {
  return name.front() == 'q' || absl::StrContains(name, "quat") ||
         absl::StrContains(name, "orientation") || absl::StrContains(name, "rot");
}

bool IsPosition(const std::string& name) {
  return IsOneOf(name, {"x", "y", "z", "tx", "ty", "tz", "px", "py", "pz"}) ||
         absl::StartsWith(name, "p_") || absl::StartsWith(name, "t_") ||
         absl::StartsWith(name, "pos") || absl::StartsWith(name, "trans") ||
         absl::StrContains(name, "position") || absl::StrContains(name, "translation");
}

bool IsStamp(const std::string& name) {
  return IsOneOf(name, {"t", "ts", "stamp"}) || absl::StartsWith(name, "time");
}

// One column, or a second one of the same name, which makes neither sure.
class Column {
 public:
  void Add(std::size_t i) { ++num_, index_ = i; }
  [[nodiscard]] bool IsSure() const { return num_ == 1; }
  [[nodiscard]] std::size_t index() const { return index_; }

 private:
  std::size_t num_ = 0;
  std::size_t index_ = 0;
};

constexpr std::size_t kNumTrailing = 7;  // position and quaternion
constexpr std::size_t kMaxDigits = 18;   // of whole seconds and nanoseconds

// Stamps before seven values in the order that they have in the row.
PoseColumns ColumnsOf(std::size_t num_values) {
  const std::size_t num_stamp = num_values - kNumTrailing;
  PoseColumns columns{.num_values = num_values};
  columns.stamp.resize(num_stamp);
  std::iota(columns.stamp.begin(), columns.stamp.end(), 0);
  std::iota(columns.xyz.begin(), columns.xyz.end(), num_stamp);
  std::iota(columns.quaternion.begin(), columns.quaternion.end(), num_stamp + 3);
  return columns;
}

}  // namespace

PoseColumns TumColumns() { return ColumnsOf(8); }

const std::array<QuaternionRows::Order, 4> QuaternionRows::kOrders = {
    {{{0, 1, 2, 3, 4, 5, 6}, "tx ty tz qx qy qz qw"},
     {{0, 1, 2, 4, 5, 6, 3}, "tx ty tz qw qx qy qz"},
     {{4, 5, 6, 0, 1, 2, 3}, "qx qy qz qw tx ty tz"},
     {{4, 5, 6, 1, 2, 3, 0}, "qw qx qy qz tx ty tz"}}};

absl::Status QuaternionRows::AppendStamp(const TextRow& row) {
  const std::vector<std::size_t>& at = columns_->stamp;
  if (at.empty()) return absl::OkStatus();
  const std::string_view token = row.values[at[0]];
  if (rows_.empty() && at.size() == 1) unit_ = LikelyUnit(token);
  const std::optional<std::int64_t> ns = ParseTimeAsNs(token, unit_);
  if (!ns) {
    return Invalid(absl::StrCat(Quote(token), " is not a time in ", ToAbsl(TimeUnitName(unit_))));
  }
  std::int64_t rest_ns = 0;
  if (at.size() == 2 &&
      (!IsWhole(token, 1, kMaxDigits) || !IsWhole(row.values[at[1]], 1, kMaxDigits) ||
       !absl::SimpleAtoi(ToAbsl(row.values[at[1]]), &rest_ns))) {
    return Invalid(absl::StrCat(Quote(token), " and ", Quote(row.values[at[1]]),
                                " are not whole seconds and nanoseconds"));
  }
  if (*ns > std::numeric_limits<std::int64_t>::max() - rest_ns) {
    return Invalid(absl::StrCat(Quote(token), " is no time in seconds that is read"));
  }
  stamps_ns_.push_back(*ns + rest_ns);
  return absl::OkStatus();
}

absl::Status QuaternionRows::Append(const TextRow& row) {
  if (!columns_) columns_ = given_ ? *given_ : ColumnsOf(row.values.size());
  RETURN_IF_ERROR(CheckNumValues(row.values, columns_->num_values));
  RETURN_IF_ERROR(AppendStamp(row));
  Row parsed{.values = {}, .line = row.line};
  for (std::size_t i = 0; i < kNumTrailing; ++i) {
    const std::size_t column = i < 3 ? columns_->xyz[i] : columns_->quaternion[i - 3];
    ASSIGN_OR_RETURN(const auto value, ParseValues<1>(std::span(&row.values[column], 1)));
    parsed.values[i] = value.front();
  }
  rows_.push_back(parsed);
  return absl::OkStatus();
}

bool QuaternionRows::HasUnitQuaternions(const Order& order) const {
  constexpr double kRounding = 1e-2;  // as PoseFromQuaternion takes it
  return std::ranges::all_of(rows_, [&](const Row& row) {
    double squares = 0.0;
    for (std::size_t i = 3; i < kNumTrailing; ++i) {
      squares += row.values[order.at[i]] * row.values[order.at[i]];
    }
    return std::abs(std::sqrt(squares) - 1.0) <= kRounding;
  });
}

// Whether nearly all poses tilt z by less than 45 degrees.
bool QuaternionRows::StandsUpright(const Order& order) const {
  constexpr double kCos45 = 0.7071;
  const auto num_upright = std::ranges::count_if(rows_, [&](const Row& row) {
    const double x = row.values[order.at[3]];
    const double y = row.values[order.at[4]];
    return 1.0 - 2.0 * (x * x + y * y) > kCos45;
  });
  return static_cast<std::size_t>(num_upright) * 20 >= rows_.size() * 19;
}

absl::StatusOr<QuaternionRows::Order> QuaternionRows::TellOrder() const {
  if (given_) return kOrders[0];
  const bool is_tum = columns_->num_values == TumColumns().num_values;
  const std::size_t first = HasUnitQuaternions(kOrders[0])   ? 0
                            : HasUnitQuaternions(kOrders[2]) ? 2
                            : is_tum                         ? 0
                                                             : kOrders.size();
  if (first < kOrders.size()) {
    if (StandsUpright(kOrders[first])) return kOrders[first];
    if (StandsUpright(kOrders[first + 1])) return kOrders[first + 1];
    if (is_tum && first == 0) return kOrders[0];
  }
  return Invalid(absl::StrCat(
      "cannot tell the format of the poses: rows of ", columns_->num_values, " values hold ",
      first < kOrders.size() ? "a quaternion, but neither with w first nor with w last does the "
                               "sensor stand upright"
                             : "no quaternion of length 1, and the stamps are not NCLT's, of 16 "
                               "digits between commas",
      "; write a headline that names the columns, such as \"x,y,z,qx,qy,qz,qw\""));
}

absl::StatusOr<Trajectory> QuaternionRows::Finish(std::string_view file) {
  const absl::StatusOr<Order> order = TellOrder();
  if (!order.ok()) return Annotate(order.status(), file);
  Trajectory trajectory{.format = PoseFormat::kTum, .stamps_ns = std::move(stamps_ns_)};
  for (const Row& row : rows_) {
    const auto value = [&](std::size_t i) { return row.values[order->at[i]]; };
    const absl::StatusOr<Pose> pose = PoseFromQuaternion(
        {value(0), value(1), value(2)}, Eigen::Quaterniond(value(6), value(3), value(4), value(5)));
    if (!pose.ok()) {
      return Annotate(pose.status(), absl::StrCat(ToAbsl(file), ":", row.line));
    }
    trajectory.T_map_sensor.push_back(*pose);
  }
  const std::size_t num_stamp = columns_->stamp.size();
  std::string text = num_stamp == 0   ? "no stamp"
                     : num_stamp == 1 ? absl::StrCat("stamp [", ToAbsl(TimeUnitName(unit_)), "]")
                                      : "stamp [s] and [ns]";
  if (!given_) absl::StrAppend(&text, ", ", ToAbsl(order->text));
  trajectory.notes.push_back(std::move(text));
  return trajectory;
}

std::optional<PoseColumns> ReadHeadline(const Tokens& headline) {
  constexpr std::string_view kParts = "xyzw";
  std::array<Column, 3> xyz;
  std::array<Column, 4> quaternion;
  Column stamp, seconds, nanoseconds;
  for (std::size_t i = 0; i < headline.size(); ++i) {
    const std::string name = Normalise(headline[i]);
    if (name.empty()) continue;
    const std::size_t part = kParts.find(name.back());
    if (IsOneOf(name, {"sec", "secs", "seconds"})) {
      seconds.Add(i);
    } else if (IsOneOf(name, {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"})) {
      nanoseconds.Add(i);
    } else if (IsStamp(name)) {
      stamp.Add(i);
    } else if (part != std::string_view::npos && IsQuaternion(name)) {
      quaternion[part].Add(i);
    } else if (part < 3 && IsPosition(name)) {
      xyz[part].Add(i);
    }
  }
  PoseColumns columns{.num_values = headline.size()};
  for (std::size_t part = 0; part < quaternion.size(); ++part) {
    if (!quaternion[part].IsSure() || (part < 3 && !xyz[part].IsSure())) return std::nullopt;
    columns.quaternion[part] = quaternion[part].index();
    if (part < 3) columns.xyz[part] = xyz[part].index();
  }
  if (seconds.IsSure() && nanoseconds.IsSure()) {
    columns.stamp = {seconds.index(), nanoseconds.index()};
  } else if (stamp.IsSure()) {
    columns.stamp = {stamp.index()};
  }
  return columns;
}

}  // namespace scanloc::dataset

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "decimal_time.hpp"
#include "pose_rows.hpp"
#include "scanloc/dataset/pose_reader.hpp"

namespace scanloc::dataset {

/// Where the values of a pose with a quaternion stand in a row.
struct PoseColumns {
  std::array<std::size_t, 3> xyz{};         ///< position
  std::array<std::size_t, 4> quaternion{};  ///< x y z w
  std::vector<std::size_t> stamp;           ///< none; one; or whole seconds and nanoseconds
  std::size_t num_values = 0;               ///< in a row
};

/// The columns that a headline names, such as "timestamp tx ty tz qx qy qz qw",
/// "#sec,nsec,x,y,...", EuRoC's "p_RS_R_x [m]" or a recorded topic's "pose.orientation.w". None
/// unless each part of position and quaternion is named once.
[[nodiscard]] std::optional<PoseColumns> ReadHeadline(const Tokens& headline);

/// Rows of a position and a quaternion, with a stamp or without. In which order they stand is taken
/// from `columns` if it is given; else it is told, once all rows are there, by what has length 1
/// and by which order of the quaternion's parts lets the sensor stand upright.
class QuaternionRows {
 public:
  /// The columns of a headline, or of a format that is known; none: to be told.
  explicit QuaternionRows(std::optional<PoseColumns> columns) : given_(std::move(columns)) {}

  /// InvalidArgument if the row has a wrong number of values or what is read is no number.
  [[nodiscard]] absl::Status Append(const TextRow& row);

  /// Poses and stamps of all rows, and as its note how they were read. InvalidArgument, with file
  /// and line, if they are no poses.
  [[nodiscard]] absl::StatusOr<Trajectory> Finish(std::string_view file);

 private:
  struct Row {
    std::array<double, 7> values;
    std::size_t line;
  };
  /// Where position and x y z w stand among the seven values.
  struct Order {
    std::array<std::size_t, 7> at;
    std::string_view text;
  };
  static const std::array<Order, 4> kOrders;

  [[nodiscard]] absl::Status AppendStamp(const TextRow& row);
  [[nodiscard]] bool HasUnitQuaternions(const Order& order) const;
  [[nodiscard]] bool StandsUpright(const Order& order) const;
  [[nodiscard]] absl::StatusOr<Order> TellOrder() const;

  std::optional<PoseColumns> given_;
  std::optional<PoseColumns> columns_;
  std::vector<Row> rows_;
  std::vector<std::int64_t> stamps_ns_;
  TimeUnit unit_ = TimeUnit::kSeconds;
};

/// Columns of TUM: stamp tx ty tz qx qy qz qw.
[[nodiscard]] PoseColumns TumColumns();

}  // namespace scanloc::dataset

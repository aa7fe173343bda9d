#include "calibration_rows.hpp"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "checksum.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/core/structural/calibrate.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

bool IsFinite(const Calibration& calibration) {
  return std::isfinite(calibration.bias) && std::isfinite(calibration.score_weight) &&
         std::isfinite(calibration.margin_weight);
}

// The one row, or none.
absl::StatusOr<std::optional<CalibrationRow>> ReadRow(Connection& connection) {
  const auto damaged = [&] {
    return DamagedError(connection.path(), "calibration: its row is malformed");
  };
  ASSIGN_OR_RETURN(Statement rows, connection.Prepare(schema::kSelectCalibration));
  absl::StatusOr<bool> is_row = rows.Step();
  if (!is_row.ok()) return is_row.status();
  if (!*is_row) return std::nullopt;
  CalibrationRow row;
  row.content_id = rows.Text(1);
  row.calibration = {rows.Real(2), rows.Real(3), rows.Real(4),
                     static_cast<std::int32_t>(rows.Int(5))};
  row.num_confusable = rows.Int(6);
  if (rows.Int(0) != 0 || rows.Int(5) != row.calibration.num_trials ||
      CalibrationChecksum(row) != rows.Int(7) || !IsFinite(row.calibration)) {
    return damaged();
  }
  is_row = rows.Step();
  if (!is_row.ok()) return is_row.status();
  if (*is_row) return damaged();
  return row;
}

absl::StatusOr<std::vector<ConfusablePair>> ReadPairs(Connection& connection,
                                                      std::int64_t num_places) {
  ASSIGN_OR_RETURN(Statement rows, connection.Prepare(schema::kSelectConfusable));
  std::vector<ConfusablePair> pairs;
  const auto is_place = [&](std::int64_t place) { return place >= 0 && place < num_places; };
  while (true) {
    ASSIGN_OR_RETURN(const bool is_row, rows.Step());
    if (!is_row) return pairs;
    const auto id = static_cast<std::int64_t>(pairs.size());
    const ConfusablePair pair{static_cast<std::int32_t>(rows.Int(1)),
                              static_cast<std::int32_t>(rows.Int(2)), rows.Real(3)};
    if (rows.Int(0) != id || ConfusableChecksum(id, pair) != rows.Int(4) ||
        !is_place(rows.Int(1)) || !is_place(rows.Int(2)) ||
        !(pair.confidence >= 0.0 && pair.confidence <= 1.0) || pairs.size() >= kMaxConfusable) {
      return DamagedError(connection.path(), absl::StrCat("confusable: row ", id, " is malformed"));
    }
    pairs.push_back(pair);
  }
}

}  // namespace

absl::StatusOr<std::optional<StoredCalibration>> ReadCalibration(Connection& connection,
                                                                 const MapHead& head) {
  if (head.schema_version < 2) return std::nullopt;
  ASSIGN_OR_RETURN(std::optional<CalibrationRow> row, ReadRow(connection));
  const bool is_current = row.has_value() && row->content_id == head.content_id;
  ASSIGN_OR_RETURN(std::vector<ConfusablePair> pairs, ReadPairs(connection, head.num_places()));
  const std::size_t num_expected =
      row.has_value() ? static_cast<std::size_t>(row->num_confusable) : 0;
  if (pairs.size() != num_expected) {
    return DamagedError(connection.path(), absl::StrCat("confusable: it has ", pairs.size(),
                                                        " rows instead of ", num_expected));
  }
  if (!is_current) return std::nullopt;
  return StoredCalibration{row->calibration, std::move(pairs)};
}

absl::Status WriteCalibration(const StoredCalibration& calibration, const std::string& content_id,
                              Connection& connection) {
  for (const char* sql : {schema::kDeleteCalibration, schema::kDeleteConfusable}) {
    RETURN_IF_ERROR(connection.Execute(sql));
  }
  // SQLite keeps no sign of a zero; adding 0 takes it off.
  const Calibration& given = calibration.calibration;
  const CalibrationRow row{
      content_id,
      {given.bias + 0.0, given.score_weight + 0.0, given.margin_weight + 0.0, given.num_trials},
      static_cast<std::int64_t>(calibration.confusable.size())};
  ASSIGN_OR_RETURN(Statement insert, connection.Prepare(schema::kInsertCalibration));
  RETURN_IF_ERROR(insert.RunWith(row.content_id, row.calibration.bias, row.calibration.score_weight,
                                 row.calibration.margin_weight,
                                 std::int64_t{row.calibration.num_trials}, row.num_confusable,
                                 CalibrationChecksum(row)));

  ASSIGN_OR_RETURN(Statement insert_pair, connection.Prepare(schema::kInsertConfusable));
  for (std::size_t i = 0; i < calibration.confusable.size(); ++i) {
    const auto id = static_cast<std::int64_t>(i);
    const ConfusablePair& pair = calibration.confusable[i];
    RETURN_IF_ERROR(insert_pair.RunWith(id, std::int64_t{pair.place}, std::int64_t{pair.lookalike},
                                        pair.confidence, ConfusableChecksum(id, pair)));
  }
  return absl::OkStatus();
}

}  // namespace scanloc::mapdb

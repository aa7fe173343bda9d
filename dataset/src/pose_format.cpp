#include "pose_format.hpp"

#include <algorithm>
#include <array>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "scan_list.hpp"

namespace scanloc::dataset {
namespace {

struct FormatInfo {
  PoseFormat format;
  std::string_view name;
  std::size_t num_values;  ///< in a row
};
constexpr std::array<FormatInfo, 9> kPoseFormats = {{{PoseFormat::kAuto, "auto", 0},
                                                     {PoseFormat::kKitti, "kitti", 12},
                                                     {PoseFormat::kTum, "tum", 8},
                                                     {PoseFormat::kMulran, "mulran", 13},
                                                     {PoseFormat::kNclt, "nclt", 7},
                                                     {PoseFormat::kOxford, "oxford", 15},
                                                     {PoseFormat::kNaver, "naver", 0},
                                                     {PoseFormat::kMatrix, "matrix", 0},
                                                     {PoseFormat::kKitti360, "kitti360", 0}}};

const FormatInfo& Info(PoseFormat format) { return kPoseFormats[static_cast<std::size_t>(format)]; }

absl::Status CannotTell(const TextRow& row, std::string_view why) {
  return Invalid(absl::StrCat("cannot tell the format of the poses: the first row has ",
                              row.values.size(), " values", ToAbsl(why),
                              "; give it as --format, or write a headline that names the columns, "
                              "such as \"timestamp,x,y,z,qx,qy,qz,qw\""));
}

}  // namespace

bool IsWhole(std::string_view token, std::size_t min_digits, std::size_t max_digits) {
  return IsNumber(token) && token.size() >= min_digits && token.size() <= max_digits;
}

std::size_t NumValues(PoseFormat format) { return Info(format).num_values; }

absl::StatusOr<PoseFormat> DetectFormat(const TextRow& first_row, bool has_naver_calib) {
  constexpr std::size_t kMaxFrameDigits = 10;
  const std::string_view first = first_row.values[0];
  switch (first_row.values.size()) {
    case 4:
    case 16:
      return has_naver_calib ? PoseFormat::kNaver : PoseFormat::kMatrix;
    case 6:
      return CannotTell(first_row,
                        ", as x y z and three angles, which are not read: their order and unit "
                        "are unknown; make quaternions of them");
    case 7:
      if (first_row.has_commas && IsWhole(first, 16, 16)) return PoseFormat::kNclt;
      return PoseFormat::kTum;
    case 8:
      return PoseFormat::kTum;
    case 9:
      if (IsWhole(first, 1, 10) && IsWhole(first_row.values[1], 1, 18)) return PoseFormat::kTum;
      return CannotTell(first_row,
                        ", of which the first two are not whole seconds and nanoseconds");
    case 12:
      return PoseFormat::kKitti;
    case 13:
      if (first_row.has_commas && IsWhole(first, 19, 19)) return PoseFormat::kMulran;
      [[fallthrough]];
    case 17:
      if (IsWhole(first, 1, kMaxFrameDigits)) return PoseFormat::kKitti360;
      return CannotTell(first_row,
                        ", but begins neither with a stamp of 19 digits and a comma, as MulRan's, "
                        "nor with the number of a frame, as KITTI-360's");
    default:
      return CannotTell(first_row,
                        "; KITTI's have 12, TUM's 8, MulRan's 13, NCLT's 7, KITTI-360's 13 or 17, "
                        "4x4 matrices 16 or four times 4, and Oxford's 15 under a headline");
  }
}

bool IsHeadline(const Tokens& row) {
  return std::ranges::none_of(row, [](std::string_view token) {
    double value = 0.0;
    return absl::SimpleAtod(ToAbsl(token), &value);
  });
}

absl::StatusOr<PoseFormat> ParsePoseFormat(std::string_view name) {
  for (const FormatInfo& info : kPoseFormats) {
    if (info.name == name) return info.format;
  }
  return Invalid(
      absl::StrCat("pose format ", Quote(name),
                   " is not auto, kitti, tum, mulran, nclt, oxford, naver, matrix or kitti360"));
}

std::string_view PoseFormatName(PoseFormat format) { return Info(format).name; }

}  // namespace scanloc::dataset

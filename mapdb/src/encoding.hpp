#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "scanloc/core/method.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "scanloc/core/scan/pose.hpp"
#include "scanloc/core/scan/structure.hpp"

/// How values look in the columns of a map file (docs/map_format.md). Numbers are little-endian.
namespace scanloc::mapdb {

using Bytes = std::vector<std::byte>;

/// Parameters by name, sorted by name; text that gives back the same bits.
using ParamTexts = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] ParamTexts EncodeParams(const Params& params);
/// InvalidArgument: a parameter is missing, malformed, or out of its range. Names that this version
/// does not know are passed over; those that files of the schema version did not have yet are what
/// its readers took for granted.
[[nodiscard]] absl::StatusOr<Params> DecodeParams(const ParamTexts& texts, int schema_version);
/// "voxel_size_m is 0.5, not 0.4" for the first field of `a` that `b` has otherwise; or empty.
[[nodiscard]] std::string DescribeDifference(const Params& a, const Params& b);

/// The 3×4 matrix [R t], row by row.
inline constexpr std::size_t kPoseBytes = 12 * sizeof(double);
[[nodiscard]] Bytes EncodePose(const Pose& pose);
/// Requires kPoseBytes. The bits as they are: the pose may be none, see CheckPose.
[[nodiscard]] Pose DecodePose(std::span<const std::byte> bytes);
/// InvalidArgument unless the pose is finite, rigid within 1e-6 and inside limits.
[[nodiscard]] absl::Status CheckPose(const Pose& pose);

void EncodeKey(std::span<const std::int32_t> key_cm, Bytes& bytes);
/// Fills key_cm. False: wrong length, or a value outside [0, max_cm].
[[nodiscard]] bool DecodeKey(std::span<const std::byte> bytes, std::int32_t max_cm,
                             std::span<std::int32_t> key_cm);

void AppendInt64(std::int64_t value, Bytes& bytes);
/// The i-th of 8-byte integers one behind the other.
[[nodiscard]] std::int64_t Int64At(std::span<const std::byte> bytes, std::size_t i);

/// Mask of the cells that are not zero, then those cells, 2 bytes each. Three quarters of the cells
/// of real maps are empty. The length tells cells from bytes within a factor of 16.
void EncodeCells(std::span<const std::uint16_t> cells_cm, Bytes& bytes);
[[nodiscard]] constexpr std::size_t MaskBytes(std::size_t num_cells) { return (num_cells + 7) / 8; }
/// Fills cells_cm. False: the bytes are not what EncodeCells gives for any cells of
/// Context::kMaxHeight_cm or less.
[[nodiscard]] bool DecodeCells(std::span<const std::byte> bytes, std::span<std::uint16_t> cells_cm);

/// x and y of post after post, 2 bytes each, signed [cm]; from schema 8 on each is followed by its
/// heights, 4 bytes.
void EncodePosts(std::span<const Post> posts, int schema_version, Bytes& bytes);
/// Fills posts. False: not a whole number of posts, or more than Structure::kMaxPosts. Does
/// not check where they lie; scanloc::Validate(Structure) does.
[[nodiscard]] bool DecodePosts(std::span<const std::byte> bytes, int schema_version,
                               std::vector<Post>& posts);

void EncodeBearings(const BearingGrid& bearings, Bytes& bytes);
/// None: wrong length.
[[nodiscard]] std::optional<BearingGrid> DecodeBearings(std::span<const std::byte> bytes);

/// OK, or InvalidArgument: a name is 1 to kMaxNameBytes bytes of UTF-8 without control characters.
[[nodiscard]] absl::Status CheckName(absl::string_view what, const std::string& name);

/// One context that every place of a map has.
struct ContextShape {
  DescriptorKind kind = DescriptorKind::kPolar;
  int variant = 0;  ///< polar: 0 the place itself, v the v-th root shift; cart: 0
  int num_rows = 0;
  int num_cols = 0;
  double root_shift_m = 0.0;

  [[nodiscard]] std::size_t num_cells() const {
    return static_cast<std::size_t>(num_rows) * num_cols;
  }
};
/// The contexts of a place, in the order in which the file holds them.
[[nodiscard]] std::vector<ContextShape> ContextShapes(const Params& params);

}  // namespace scanloc::mapdb

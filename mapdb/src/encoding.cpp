#include "encoding.hpp"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "scanloc/core/byte_order.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

constexpr double kRigidTolerance = 1e-6;

std::size_t PostBytes(int schema_version) {
  const std::size_t spot = 2 * sizeof(std::int16_t);
  return schema_version < schema::kHeightsVersion ? spot : spot + sizeof(std::uint32_t);
}

}  // namespace

Bytes EncodePose(const Pose& pose) {
  Bytes bytes(kPoseBytes);
  std::byte* next = bytes.data();
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 4; ++col, next += sizeof(double)) {
      StoreLittleEndian(double{pose(row, col)}, next);
    }
  }
  return bytes;
}

Pose DecodePose(std::span<const std::byte> bytes) {
  Pose pose = Pose::Identity();
  const std::byte* next = bytes.data();
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 4; ++col, next += sizeof(double)) {
      pose(row, col) = LoadNumber<double>(next);
    }
  }
  return pose;
}

absl::Status CheckPose(const Pose& pose) {
  if (!pose.matrix().allFinite()) {
    return absl::InvalidArgumentError("the pose has a number that is not finite");
  }
  const Eigen::Matrix3d rotation = pose.linear();
  const double error =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kRigidTolerance) || !(rotation.determinant() > 0.0)) {
    return absl::InvalidArgumentError("the pose is not rigid: its 3×3 part is no rotation");
  }
  if (!(pose.translation().cwiseAbs().maxCoeff() <= limits::kMaxTranslation_m)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the pose lies farther than ", limits::kMaxTranslation_m, " m from the origin"));
  }
  return absl::OkStatus();
}

void EncodeKey(std::span<const std::int32_t> key_cm, Bytes& bytes) {
  bytes.resize(key_cm.size_bytes());
  for (std::size_t i = 0; i < key_cm.size(); ++i) {
    StoreLittleEndian(key_cm[i], bytes.data() + 4 * i);
  }
}

bool DecodeKey(std::span<const std::byte> bytes, std::int32_t max_cm,
               std::span<std::int32_t> key_cm) {
  if (bytes.size() != key_cm.size_bytes()) return false;
  bool in_range = true;
  for (std::size_t i = 0; i < key_cm.size(); ++i) {
    key_cm[i] = LoadNumber<std::int32_t>(bytes.data() + 4 * i);
    in_range &= key_cm[i] >= 0 && key_cm[i] <= max_cm;
  }
  return in_range;
}

void AppendInt64(std::int64_t value, Bytes& bytes) {
  bytes.resize(bytes.size() + sizeof(value));
  StoreLittleEndian(value, bytes.data() + bytes.size() - sizeof(value));
}

std::int64_t Int64At(std::span<const std::byte> bytes, std::size_t i) {
  return LoadNumber<std::int64_t>(bytes.data() + sizeof(std::int64_t) * i);
}

void EncodeBearings(const BearingGrid& bearings, Bytes& bytes) {
  bytes.clear();
  for (const std::uint64_t ring : bearings.rings()) {
    AppendInt64(static_cast<std::int64_t>(ring), bytes);
  }
}

std::optional<BearingGrid> DecodeBearings(std::span<const std::byte> bytes) {
  BearingGrid::Rings rings;
  if (bytes.size() != sizeof(rings)) return std::nullopt;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    rings[i] = static_cast<std::uint64_t>(Int64At(bytes, i));
  }
  return BearingGrid(rings);
}

void EncodeCells(std::span<const std::uint16_t> cells_cm, Bytes& bytes) {
  const std::size_t mask_bytes = MaskBytes(cells_cm.size());
  bytes.assign(mask_bytes + cells_cm.size_bytes(), std::byte{0});
  std::byte* next = bytes.data() + mask_bytes;
  for (std::size_t i = 0; i < cells_cm.size(); ++i) {
    if (cells_cm[i] != 0) {
      bytes[i / 8] |= std::byte{1} << (i % 8);
      StoreLittleEndian(cells_cm[i], next);
      next += sizeof(std::uint16_t);
    }
  }
  bytes.resize(next - bytes.data());
}

bool DecodeCells(std::span<const std::byte> bytes, std::span<std::uint16_t> cells_cm) {
  const std::size_t mask_bytes = MaskBytes(cells_cm.size());
  if (bytes.size() < mask_bytes) return false;
  const std::byte* next = bytes.data() + mask_bytes;
  const std::byte* const end = bytes.data() + bytes.size();
  std::ranges::fill(cells_cm, std::uint16_t{0});
  bool in_range = true;
  for (std::size_t i = 0; i < mask_bytes; ++i) {
    for (auto mask = std::to_integer<unsigned>(bytes[i]); mask != 0; mask &= mask - 1) {
      const std::size_t cell = 8 * i + std::countr_zero(mask);
      if (cell >= cells_cm.size() || end - next < 2) return false;
      cells_cm[cell] = LoadNumber<std::uint16_t>(next);
      in_range &= cells_cm[cell] - 1U < Context::kMaxHeight_cm;
      next += 2;
    }
  }
  return in_range && next == end;
}

void EncodePosts(std::span<const Post> posts, int schema_version, Bytes& bytes) {
  const std::size_t post_bytes = PostBytes(schema_version);
  bytes.resize(posts.size() * post_bytes);
  std::byte* next = bytes.data();
  for (const Post& post : posts) {
    StoreLittleEndian(post.x_cm, next);
    StoreLittleEndian(post.y_cm, next + 2);
    if (schema_version >= schema::kHeightsVersion) StoreLittleEndian(post.heights, next + 4);
    next += post_bytes;
  }
}

bool DecodePosts(std::span<const std::byte> bytes, int schema_version, std::vector<Post>& posts) {
  const std::size_t post_bytes = PostBytes(schema_version);
  if (bytes.size() % post_bytes != 0 || bytes.size() / post_bytes > Structure::kMaxPosts) {
    return false;
  }
  posts.resize(bytes.size() / post_bytes);
  const std::byte* next = bytes.data();
  for (Post& post : posts) {
    post = {LoadNumber<std::int16_t>(next), LoadNumber<std::int16_t>(next + 2)};
    if (schema_version >= schema::kHeightsVersion) {
      post.heights = LoadNumber<std::uint32_t>(next + 4);
    }
    next += post_bytes;
  }
  return true;
}

absl::Status CheckName(absl::string_view what, const std::string& name) {
  if (name.empty() || name.size() > limits::kMaxNameBytes) {
    return absl::InvalidArgumentError(absl::StrCat("the name of ", what, " has ", name.size(),
                                                   " bytes; it must have 1 to ",
                                                   limits::kMaxNameBytes));
  }
  const std::string_view text = name;
  for (std::size_t i = 0; i < text.size();) {
    const auto [code, num_bytes] = FirstUtf8Character(text.substr(i));
    if (num_bytes == 0 || code < 0x20 || code == 0x7f) {
      return absl::InvalidArgumentError(absl::StrCat(
          "the name of ", what, " is not UTF-8 text or has a control character, at byte ", i,
          "; rename it"));
    }
    i += num_bytes;
  }
  return absl::OkStatus();
}

std::vector<ContextShape> ContextShapes(const Params& params) {
  std::vector<ContextShape> shapes;
  if (params.polar.enabled) {
    ContextShape shape{DescriptorKind::kPolar, 0, params.polar.num_rings, params.polar.num_sectors,
                       0.0};
    shapes.push_back(shape);
    for (const double root_shift_m : params.polar.root_shifts_m) {
      ++shape.variant;
      shape.root_shift_m = root_shift_m;
      shapes.push_back(shape);
    }
  }
  if (params.cart.enabled) {
    shapes.push_back({DescriptorKind::kCart, 0, params.cart.num_rows, params.cart.num_cols, 0.0});
  }
  return shapes;
}

}  // namespace scanloc::mapdb

// What a robot sends of one scan: its points, or its descriptors, and what goes with them.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc::proto {
namespace {

// Points and cells are copied as they lie in memory.
static_assert(std::endian::native == std::endian::little);
constexpr std::size_t kSpotBytes = sizeof(Post::x_cm) + sizeof(Post::y_cm);

template <typename Number>
void AppendBytes(Number number, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

absl::StatusOr<Context> FromProto(absl::string_view field, const v1::Context& message) {
  for (const auto& [side, length] :
       {std::pair("num_rows", message.num_rows()), std::pair("num_cols", message.num_cols())}) {
    RETURN_IF_ERROR(
        CheckRange(absl::StrCat(field, ".", side), length, 1, limits::kMaxDescriptorSide));
  }
  Context context{.num_rows = message.num_rows(), .num_cols = message.num_cols(), .cells_cm = {}};
  const std::size_t num_cells = static_cast<std::size_t>(context.num_rows) * context.num_cols;
  const std::string& bytes = message.cells_u16le();
  if (bytes.size() != num_cells * sizeof(std::uint16_t)) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " announces ", context.num_rows, "x", context.num_cols, " cells, ",
                     num_cells * sizeof(std::uint16_t), " bytes, but has ", bytes.size()));
  }
  context.cells_cm.resize(num_cells);
  std::memcpy(context.cells_cm.data(), bytes.data(), bytes.size());
  return context;
}

v1::Context ToProto(const Context& context) {
  v1::Context message;
  message.set_num_rows(context.num_rows);
  message.set_num_cols(context.num_cols);
  message.set_cells_u16le(context.cells_cm.data(), context.cells_cm.size() * sizeof(std::uint16_t));
  return message;
}

}  // namespace

absl::StatusOr<Structure> StructureFromProto(const v1::Structure& message) {
  const std::string& bytes = message.posts_i16le();
  const std::size_t num_posts = bytes.size() / kSpotBytes;
  if (bytes.size() % kSpotBytes != 0 || num_posts > Structure::kMaxPosts) {
    return absl::InvalidArgumentError(absl::StrCat(
        "descriptors.structure.posts_i16le has ", bytes.size(), " bytes; it must be x and y of at",
        " most ", Structure::kMaxPosts, " posts, 2 bytes each"));
  }
  Structure structure{.roll_rad = message.roll_rad(),
                      .pitch_rad = message.pitch_rad(),
                      .height_m = message.height_m(),
                      .posts = std::vector<Post>(num_posts)};
  const std::string& heights = message.heights_u32le();
  if (!heights.empty() && heights.size() != num_posts * sizeof(Post::heights)) {
    return absl::InvalidArgumentError(
        absl::StrCat("descriptors.structure.heights_u32le has ", heights.size(),
                     " bytes; it must be", " 4 for each of the ", num_posts, " posts, or empty"));
  }
  for (std::size_t i = 0; i < num_posts; ++i) {
    Post& post = structure.posts[i];
    std::memcpy(&post.x_cm, bytes.data() + i * kSpotBytes, sizeof(post.x_cm));
    std::memcpy(&post.y_cm, bytes.data() + i * kSpotBytes + sizeof(post.x_cm), sizeof(post.y_cm));
    if (heights.empty()) continue;
    std::memcpy(&post.heights, heights.data() + i * sizeof(post.heights), sizeof(post.heights));
  }
  if (auto status = Validate(structure); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("descriptors.structure: ", status.message()));
  }
  return structure;
}

v1::Structure StructureToProto(const Structure& structure) {
  v1::Structure message;
  message.set_roll_rad(structure.roll_rad);
  message.set_pitch_rad(structure.pitch_rad);
  message.set_height_m(structure.height_m);
  std::string& spots = *message.mutable_posts_i16le();
  std::string& heights = *message.mutable_heights_u32le();
  spots.reserve(structure.posts.size() * kSpotBytes);
  heights.reserve(structure.posts.size() * sizeof(Post::heights));
  for (const Post& post : structure.posts) {
    AppendBytes(post.x_cm, spots);
    AppendBytes(post.y_cm, spots);
    AppendBytes(post.heights, heights);
  }
  return message;
}

namespace {

v1::SensorMount ToProto(const SensorMount& mount) {
  v1::SensorMount message;
  *message.mutable_t_base_sensor() = PoseToProto(mount.T_base_sensor);
  message.set_min_range_m(mount.min_range_m);
  if (mount.self_box) *message.mutable_self_box() = BoxToProto(*mount.self_box);
  return message;
}

}  // namespace

absl::Status FromProto(const v1::ScanPoints& message, PointCloud* points) {
  if (message.num_points() > limits::kMaxPointsPerScan) {
    return absl::InvalidArgumentError(absl::StrCat("scan.num_points is ", message.num_points(),
                                                   "; at most ", limits::kMaxPointsPerScan,
                                                   " points make a scan"));
  }
  const std::string& bytes = message.xyz_f32le();
  if (bytes.size() != message.num_points() * sizeof(Point)) {
    return absl::InvalidArgumentError(
        absl::StrCat("scan announces ", message.num_points(), " points, ",
                     message.num_points() * sizeof(Point), " bytes, but scan.xyz_f32le has ",
                     bytes.size(), "; send x y z of every point as little-endian float32"));
  }
  points->resize(message.num_points());
  if (!bytes.empty()) std::memcpy(points->data(), bytes.data(), bytes.size());
  return absl::OkStatus();
}

v1::ScanPoints ToProto(PointView points, const SensorMount& mount) {
  v1::ScanPoints message;
  message.set_num_points(points.size());
  message.set_xyz_f32le(points.data(), points.size_bytes());
  if (!(mount == SensorMount())) *message.mutable_mount() = ToProto(mount);
  return message;
}

absl::StatusOr<SensorMount> MountFromProto(const v1::ScanPoints& message) {
  SensorMount mount;
  if (!message.has_mount()) return mount;
  const v1::SensorMount& given = message.mount();
  if (given.has_t_base_sensor()) {
    ASSIGN_OR_RETURN(mount.T_base_sensor,
                     PoseFromProto("scan.mount.T_base_sensor", given.t_base_sensor()));
  }
  mount.min_range_m = given.min_range_m();
  if (given.has_self_box()) {
    ASSIGN_OR_RETURN(mount.self_box, BoxFromProto("scan.mount.self_box", given.self_box()));
  }
  if (auto status = Validate(mount); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("scan.mount: ", status.message()));
  }
  return mount;
}

absl::StatusOr<ScanHeader> HeaderFromProto(const v1::LocalizeRequest& message) {
  RETURN_IF_ERROR(CheckLength("frame_id", message.frame_id(), limits::kMaxNameBytes));
  return ScanHeader{.stamp_ns = message.stamp_ns(), .frame_id = message.frame_id()};
}

void SetHeader(const ScanHeader& header, v1::LocalizeRequest* message) {
  message->set_stamp_ns(header.stamp_ns);
  message->set_frame_id(header.frame_id);
}

absl::StatusOr<SignedDescriptor> FromProto(const v1::Descriptors& message) {
  RETURN_IF_ERROR(CheckLength("descriptors.signature", message.signature(), kMaxSignatureBytes));
  SignedDescriptor result;
  result.signature = message.signature();
  if (message.has_polar()) {
    ASSIGN_OR_RETURN(result.descriptor.polar, FromProto("descriptors.polar", message.polar()));
  }
  if (message.has_cart()) {
    ASSIGN_OR_RETURN(result.descriptor.cart, FromProto("descriptors.cart", message.cart()));
  }
  if (message.has_structure()) {
    ASSIGN_OR_RETURN(result.descriptor.structure, StructureFromProto(message.structure()));
  }
  result.descriptor.num_voxels = message.num_voxels();
  result.descriptor.knows_up = !message.up_unknown();
  return result;
}

v1::Descriptors ToProto(const SignedDescriptor& descriptor) {
  v1::Descriptors message;
  message.set_signature(descriptor.signature);
  if (!descriptor.descriptor.polar.empty()) {
    *message.mutable_polar() = ToProto(descriptor.descriptor.polar);
  }
  if (!descriptor.descriptor.cart.empty()) {
    *message.mutable_cart() = ToProto(descriptor.descriptor.cart);
  }
  if (!(descriptor.descriptor.structure == Structure{})) {
    *message.mutable_structure() = StructureToProto(descriptor.descriptor.structure);
  }
  message.set_num_voxels(descriptor.descriptor.num_voxels);
  message.set_up_unknown(!descriptor.descriptor.knows_up);
  return message;
}

}  // namespace scanloc::proto

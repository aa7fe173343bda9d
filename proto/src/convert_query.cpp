#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/v1/capture.pb.h"

namespace scanloc::proto {
namespace {

// Points and cells are copied as they lie in memory.
static_assert(std::endian::native == std::endian::little);

absl::StatusOr<Context> FromProto(absl::string_view field, const v1::Context& message) {
  for (const auto& [side, length] :
       {std::pair("num_rows", message.num_rows()), std::pair("num_cols", message.num_cols())}) {
    if (auto status =
            CheckRange(absl::StrCat(field, ".", side), length, 1, limits::kMaxDescriptorSide);
        !status.ok()) {
      return status;
    }
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

absl::StatusOr<Structure> FromProto(const v1::Structure& message) {
  const std::string& bytes = message.posts_i16le();
  if (bytes.size() % sizeof(Post) != 0 || bytes.size() / sizeof(Post) > Structure::kMaxPosts) {
    return absl::InvalidArgumentError(absl::StrCat(
        "descriptors.structure.posts_i16le has ", bytes.size(), " bytes; it must be x and y of at",
        " most ", Structure::kMaxPosts, " posts, 2 bytes each"));
  }
  Structure structure{.roll_rad = message.roll_rad(),
                      .pitch_rad = message.pitch_rad(),
                      .height_m = message.height_m(),
                      .posts = std::vector<Post>(bytes.size() / sizeof(Post))};
  if (!bytes.empty()) std::memcpy(structure.posts.data(), bytes.data(), bytes.size());
  if (auto status = Validate(structure); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("descriptors.structure: ", status.message()));
  }
  return structure;
}

v1::Structure ToProto(const Structure& structure) {
  v1::Structure message;
  message.set_roll_rad(structure.roll_rad);
  message.set_pitch_rad(structure.pitch_rad);
  message.set_height_m(structure.height_m);
  message.set_posts_i16le(structure.posts.data(), structure.posts.size() * sizeof(Post));
  return message;
}

v1::Method ToProto(const Method& method) {
  if (method.automatic) return v1::METHOD_AUTO;
  if (method.kind == DescriptorKind::kPolar) {
    return method.augmented ? v1::METHOD_A_PC : v1::METHOD_PC;
  }
  return method.augmented ? v1::METHOD_A_CC : v1::METHOD_CC;
}

absl::Status SetMethod(const v1::LocalizeOptions& message, Query* query) {
  Method method{.naive_alignment = message.naive_alignment(), .brute_force = message.brute_force()};
  const v1::Method name = message.method();
  switch (name) {
    case v1::METHOD_PC:
    case v1::METHOD_A_PC:
      method.kind = DescriptorKind::kPolar;
      break;
    case v1::METHOD_CC:
    case v1::METHOD_A_CC:
      method.kind = DescriptorKind::kCart;
      break;
    case v1::METHOD_AUTO:
      method.automatic = true;
      [[fallthrough]];
    case v1::METHOD_UNSPECIFIED:
      if (!method.naive_alignment && !method.brute_force) break;
      return absl::InvalidArgumentError(
          "options.naive_alignment and options.brute_force go with the methods PC, CC, A_PC and "
          "A_CC only");
    default:
      return absl::InvalidArgumentError(absl::StrCat("options.method is ", static_cast<int>(name),
                                                     ", which is none; see enum Method"));
  }
  method.augmented = name != v1::METHOD_PC && name != v1::METHOD_CC;
  if (name != v1::METHOD_UNSPECIFIED) query->method = method;
  return absl::OkStatus();
}

v1::SensorMount ToProto(const SensorMount& mount) {
  v1::SensorMount message;
  *message.mutable_t_base_sensor() = PoseToProto(mount.T_base_sensor);
  message.set_min_range_m(mount.min_range_m);
  if (mount.self_box) {
    v1::Box& box = *message.mutable_self_box();
    box.set_min_x_m(mount.self_box->min_m.x());
    box.set_min_y_m(mount.self_box->min_m.y());
    box.set_min_z_m(mount.self_box->min_m.z());
    box.set_max_x_m(mount.self_box->max_m.x());
    box.set_max_y_m(mount.self_box->max_m.y());
    box.set_max_z_m(mount.self_box->max_m.z());
  }
  return message;
}

absl::StatusOr<Prior> FromProto(const v1::Prior& message) {
  Prior prior;
  if (message.has_disc()) {
    const v1::Prior::Disc& disc = message.disc();
    prior.disc = {.x_m = disc.x_m(), .y_m = disc.y_m(), .radius_m = disc.radius_m()};
  }
  if (message.has_heights()) {
    prior.heights = {.min_m = message.heights().min_m(), .max_m = message.heights().max_m()};
  }
  for (const std::string& session : message.sessions()) {
    auto status = CheckLength("options.prior.sessions", session, limits::kMaxNameBytes);
    if (!status.ok()) return status;
    prior.sessions.push_back(session);
  }
  if (auto status = Validate(prior); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("options.prior: ", status.message()));
  }
  return prior;
}

v1::Prior ToProto(const Prior& prior) {
  v1::Prior message;
  if (prior.disc) {
    message.mutable_disc()->set_x_m(prior.disc->x_m);
    message.mutable_disc()->set_y_m(prior.disc->y_m);
    message.mutable_disc()->set_radius_m(prior.disc->radius_m);
  }
  if (prior.heights) {
    message.mutable_heights()->set_min_m(prior.heights->min_m);
    message.mutable_heights()->set_max_m(prior.heights->max_m);
  }
  message.mutable_sessions()->Add(prior.sessions.begin(), prior.sessions.end());
  return message;
}

// Absent, or in [0, 1].
absl::Status CheckShare(const char* field, bool is_set, double value) {
  return is_set ? CheckRange(field, value, 0.0, 1.0) : absl::OkStatus();
}

}  // namespace

absl::Status CheckMapName(const std::string& name) {
  return CheckLength("map", name, limits::kMaxNameBytes);
}

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
    const auto pose = PoseFromProto("scan.mount.T_base_sensor", given.t_base_sensor());
    if (!pose.ok()) return pose.status();
    mount.T_base_sensor = *pose;
  }
  mount.min_range_m = given.min_range_m();
  if (given.has_self_box()) {
    const v1::Box& box = given.self_box();
    mount.self_box = Box{{box.min_x_m(), box.min_y_m(), box.min_z_m()},
                         {box.max_x_m(), box.max_y_m(), box.max_z_m()}};
  }
  if (auto status = Validate(mount); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("scan.mount: ", status.message()));
  }
  return mount;
}

absl::StatusOr<ScanHeader> HeaderFromProto(const v1::LocalizeRequest& message) {
  if (auto status = CheckLength("frame_id", message.frame_id(), limits::kMaxNameBytes);
      !status.ok()) {
    return status;
  }
  return ScanHeader{.stamp_ns = message.stamp_ns(), .frame_id = message.frame_id()};
}

void SetHeader(const ScanHeader& header, v1::LocalizeRequest* message) {
  message->set_stamp_ns(header.stamp_ns);
  message->set_frame_id(header.frame_id);
}

absl::StatusOr<SignedDescriptor> FromProto(const v1::Descriptors& message) {
  if (auto status = CheckLength("descriptors.signature", message.signature(), kMaxSignatureBytes);
      !status.ok()) {
    return status;
  }
  SignedDescriptor result;
  result.signature = message.signature();
  if (message.has_polar()) {
    auto polar = FromProto("descriptors.polar", message.polar());
    if (!polar.ok()) return polar.status();
    result.descriptor.polar = *std::move(polar);
  }
  if (message.has_cart()) {
    auto cart = FromProto("descriptors.cart", message.cart());
    if (!cart.ok()) return cart.status();
    result.descriptor.cart = *std::move(cart);
  }
  if (message.has_structure()) {
    auto structure = FromProto(message.structure());
    if (!structure.ok()) return structure.status();
    result.descriptor.structure = *std::move(structure);
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
    *message.mutable_structure() = ToProto(descriptor.descriptor.structure);
  }
  message.set_num_voxels(descriptor.descriptor.num_voxels);
  message.set_up_unknown(!descriptor.descriptor.knows_up);
  return message;
}

// All is checked here, though the Localizer would refuse it too: a query that cannot be answered
// should not cost the description of its scan.
absl::StatusOr<Query> FromProto(const v1::LocalizeOptions& message) {
  Query query;
  if (auto status = SetMethod(message, &query); !status.ok()) return status;
  if (message.has_num_candidates()) {
    if (auto status = CheckRange("options.num_candidates", message.num_candidates(), 1,
                                 limits::kMaxCandidates);
        !status.ok()) {
      return status;
    }
    query.num_candidates = message.num_candidates();
  }
  absl::Status status =
      CheckShare("options.threshold", message.has_threshold(), message.threshold());
  status.Update(
      CheckShare("options.min_confidence", message.has_min_confidence(), message.min_confidence()));
  if (!status.ok()) return status;
  if (message.has_threshold()) query.threshold = message.threshold();
  if (message.has_min_confidence()) query.min_confidence = message.min_confidence();
  if (message.has_max_answers()) {
    status = CheckRange("options.max_answers", message.max_answers(), 1, limits::kMaxCandidates);
    if (!status.ok()) return status;
    query.max_answers = message.max_answers();
  }
  if (message.has_prior()) {
    auto prior = FromProto(message.prior());
    if (!prior.ok()) return prior.status();
    query.prior = *std::move(prior);
  }
  return query;
}

absl::StatusOr<std::chrono::milliseconds> BudgetFromProto(const v1::LocalizeOptions& message) {
  if (!message.has_budget_ms()) return std::chrono::milliseconds(0);
  if (auto status = CheckRange("options.budget_ms", message.budget_ms(), 1,
                               std::numeric_limits<std::int32_t>::max());
      !status.ok()) {
    return status;
  }
  return std::chrono::milliseconds(message.budget_ms());
}

v1::LocalizeOptions ToProto(const Query& query, std::chrono::milliseconds budget) {
  v1::LocalizeOptions message;
  if (query.method) {
    message.set_method(ToProto(*query.method));
    message.set_naive_alignment(query.method->naive_alignment);
    message.set_brute_force(query.method->brute_force);
  }
  if (query.num_candidates) message.set_num_candidates(*query.num_candidates);
  if (query.threshold) message.set_threshold(*query.threshold);
  if (query.min_confidence) message.set_min_confidence(*query.min_confidence);
  if (budget.count() != 0) {
    constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
    message.set_budget_ms(static_cast<std::int32_t>(
        std::clamp<std::chrono::milliseconds::rep>(budget.count(), -1, kMost)));
  }
  message.set_max_answers(query.max_answers);
  if (!query.prior.is_open()) *message.mutable_prior() = ToProto(query.prior);
  return message;
}

absl::StatusOr<CapturedQuery> ParseCapturedQuery(const std::string& bytes) {
  v1::CapturedQuery message;
  if (!message.ParseFromString(bytes)) {
    return absl::InvalidArgumentError("the bytes are not a captured query");
  }
  const v1::LocalizeRequest& request = message.request();
  CapturedQuery captured{.request_id = message.request_id(), .map = request.map()};
  if (auto status = CheckMapName(captured.map); !status.ok()) return status;
  auto query = FromProto(request.options());
  if (!query.ok()) return query.status();
  captured.query = *std::move(query);
  auto header = HeaderFromProto(request);
  if (!header.ok()) return header.status();
  captured.header = *std::move(header);
  const auto budget = BudgetFromProto(request.options());
  if (!budget.ok()) return budget.status();
  captured.budget = *budget;
  auto reply = FromProto(message.response());
  if (!reply.ok()) return reply.status();
  captured.reply = *std::move(reply);
  if (request.has_scan()) {
    if (auto status = FromProto(request.scan(), &captured.scan); !status.ok()) return status;
    auto mount = MountFromProto(request.scan());
    if (!mount.ok()) return mount.status();
    captured.mount = *mount;
  } else if (request.has_descriptors()) {
    auto descriptor = FromProto(request.descriptors());
    if (!descriptor.ok()) return descriptor.status();
    captured.descriptor = *std::move(descriptor);
  } else {
    return absl::InvalidArgumentError("the captured query has neither scan nor descriptors");
  }
  return captured;
}

}  // namespace scanloc::proto

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scanloc/core/limits.hpp"
#include "scanloc/proto/as_received.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc::proto {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void ExpectInvalid(const absl::Status& status, const char* what) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(what));
}

TEST(ConvertScan, BringsPointsBackAsTheyWere) {
  const float inf = std::numeric_limits<float>::infinity();
  const PointCloud scan = {{1.5F, -2.25F, 0.1F}, {inf, 0.0F, -inf}, {-0.0F, 1e-30F, 4096.0F}};
  PointCloud back = {{9, 9, 9}};
  ASSERT_TRUE(FromProto(ToProto(scan), &back).ok());
  EXPECT_EQ(back, scan);
}

TEST(ConvertScan, BringsAnEmptyScanBack) {
  PointCloud back = {{9, 9, 9}};
  ASSERT_TRUE(FromProto(ToProto(PointView()), &back).ok());
  EXPECT_TRUE(back.empty());
}

TEST(ConvertScan, LetsNanPointsThrough) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  PointCloud back;
  ASSERT_TRUE(FromProto(ToProto(PointCloud{{nan, nan, nan}}), &back).ok());
  ASSERT_EQ(back.size(), 1U);
  EXPECT_TRUE(std::isnan(back[0].x));
}

TEST(ConvertScan, LaysPointsOutAsLittleEndianFloats) {
  const v1::ScanPoints message = ToProto(PointCloud{{1.0F, -2.0F, 0.5F}});
  EXPECT_EQ(message.num_points(), 1U);
  EXPECT_EQ(message.xyz_f32le(), std::string("\0\0\x80\x3f\0\0\0\xc0\0\0\0\x3f", 12));
}

TEST(ConvertScan, RefusesMorePointsAnnouncedThanSent) {
  v1::ScanPoints message = ToProto(PointCloud(3));
  message.set_num_points(4);
  PointCloud back;
  ExpectInvalid(FromProto(message, &back), "announces 4 points, 48 bytes");
}

TEST(ConvertScan, RefusesHundredMillionPointsWithoutMakingRoom) {
  v1::ScanPoints message = ToProto(PointCloud(3));
  message.set_num_points(100'000'000);
  PointCloud back;
  ExpectInvalid(FromProto(message, &back), "100000000");
  EXPECT_EQ(back.capacity(), 0U);
}

TEST(ConvertScan, RefusesACountWhoseBytesOverflow) {
  v1::ScanPoints message;
  message.set_num_points((std::numeric_limits<std::uint64_t>::max() / 12) + 1);
  PointCloud back;
  ExpectInvalid(FromProto(message, &back), "at most");
}

TEST(ConvertScan, RefusesBytesThatAreNoWholePoints) {
  v1::ScanPoints message;
  message.set_num_points(1);
  message.set_xyz_f32le(std::string(13, '\0'));
  PointCloud back;
  ExpectInvalid(FromProto(message, &back), "13");
}

TEST(ConvertMount, BringsItBack) {
  SensorMount mount{.min_range_m = 1.25, .self_box = Box{{-2.0, -1.0, 0.0}, {2.0, 1.0, 1.7}}};
  mount.T_base_sensor = *MountPose({0.1, 0.2, 1.3}, {179.0, -12.0, 33.0});
  EXPECT_EQ(*MountFromProto(ToProto(PointView(), mount)), AsReceived(mount));
  EXPECT_EQ(*MountFromProto(ToProto(PointView())), SensorMount());
}

TEST(ConvertMount, RefusesWhatIsOutOfRange) {
  v1::ScanPoints message;
  message.mutable_mount()->mutable_t_base_sensor()->set_qw(3.0);
  ExpectInvalid(MountFromProto(message).status(), "scan.mount.T_base_sensor");
  message.mutable_mount()->clear_t_base_sensor();
  message.mutable_mount()->set_min_range_m(kNan);
  ExpectInvalid(MountFromProto(message).status(), "scan.mount: the nearest range");
  message.mutable_mount()->set_min_range_m(0.0);
  message.mutable_mount()->mutable_self_box()->set_max_x_m(1.0);
  ExpectInvalid(MountFromProto(message).status(), "Y0 = 0 m to Y1 = 0 m");
}

TEST(ConvertPrior, BringsItBackAndRefusesWhatIsOutOfRange) {
  const Query query{
      .prior = {.disc = {{1.0, -2.0, 30.0}}, .heights = {{-1.0, 2.5}}, .sessions = {"one", "two"}}};
  EXPECT_EQ(*FromProto(ToProto(query)), query);
  const Query on_earth{.prior = {.on_earth = {{48.1, -11.5, 300.0}}}};
  EXPECT_EQ(*FromProto(ToProto(on_earth)), on_earth);
  v1::LocalizeOptions options;
  options.mutable_prior()->mutable_on_earth()->set_latitude_deg(kNan);
  ExpectInvalid(FromProto(options).status(), "options.prior: the prior is within 0 m");
  options.mutable_prior()->clear_on_earth();
  options.mutable_prior()->mutable_disc();
  ExpectInvalid(FromProto(options).status(), "options.prior: the prior is within 0 m");
  options.mutable_prior()->clear_disc();
  options.mutable_prior()->mutable_heights()->set_min_m(kNan);
  ExpectInvalid(FromProto(options).status(), "options.prior: the prior's heights");
  options.mutable_prior()->clear_heights();
  options.mutable_prior()->add_sessions(std::string(limits::kMaxNameBytes + 1, 'x'));
  ExpectInvalid(FromProto(options).status(), "options.prior.sessions has 256 bytes");
}

TEST(ConvertHeader, RefusesALongFrame) {
  v1::LocalizeRequest message;
  SetHeader({.stamp_ns = -5, .frame_id = "velodyne"}, &message);
  EXPECT_EQ(*HeaderFromProto(message), (ScanHeader{.stamp_ns = -5, .frame_id = "velodyne"}));
  message.set_frame_id(std::string(limits::kMaxNameBytes + 1, 'x'));
  ExpectInvalid(HeaderFromProto(message).status(), "frame_id has 256 bytes");
}

Context MakeContext(int num_rows, int num_cols) {
  Context context{.num_rows = num_rows, .num_cols = num_cols, .cells_cm = {}};
  for (int i = 0; i < num_rows * num_cols; ++i) context.cells_cm.push_back(i * 7 % 8192);
  return context;
}

TEST(ConvertDescriptor, BringsDescriptorsBackAsTheyWere) {
  const SignedDescriptor sent{
      .signature = "made with care",
      .descriptor = {.polar = MakeContext(20, 60), .cart = MakeContext(40, 40), .num_voxels = 77}};
  const auto back = FromProto(ToProto(sent));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->signature, sent.signature);
  EXPECT_EQ(back->descriptor, sent.descriptor);
}

TEST(ConvertDescriptor, BringsAKindThatIsNotEnabledBackEmpty) {
  SignedDescriptor sent;
  sent.descriptor.cart = MakeContext(40, 40);
  const auto back = FromProto(ToProto(sent));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->descriptor, sent.descriptor);
}

TEST(ConvertDescriptor, RefusesBadShapes) {
  const SignedDescriptor good{.signature = "s",
                              .descriptor = {.polar = MakeContext(2, 3), .cart = {}}};
  struct Case {
    int num_rows, num_cols;
    std::size_t num_bytes;
  };
  for (const Case& c :
       {Case{2, 3, 11}, Case{2, 3, 13}, Case{2, 3, 0}, Case{0, 3, 0}, Case{-2, -3, 12},
        Case{2, 4, 12}, Case{721, 1, 1442}, Case{std::numeric_limits<int>::max(), 2, 12},
        Case{std::numeric_limits<int>::min(), 2, 12}}) {
    SCOPED_TRACE(testing::Message() << c.num_rows << "x" << c.num_cols << " " << c.num_bytes);
    v1::Descriptors message = ToProto(good);
    message.mutable_polar()->set_num_rows(c.num_rows);
    message.mutable_polar()->set_num_cols(c.num_cols);
    message.mutable_polar()->mutable_cells_u16le()->resize(c.num_bytes);
    ExpectInvalid(FromProto(message).status(), "descriptors.polar");
  }
}

TEST(ConvertDescriptor, RefusesAnEndlessSignature) {
  v1::Descriptors message;
  message.set_signature(std::string(100'000, 'x'));
  ExpectInvalid(FromProto(message).status(), "signature");
}

TEST(ConvertOptions, BringsOptionsBackAsTheyWere) {
  Query sent;
  sent.num_candidates = 25;
  sent.threshold = 0.1 + 0.2;
  sent.max_answers = 7;
  for (const char* method : {"auto", "pc", "cc-brute", "a-pc-naive-brute", "a-cc-naive"}) {
    sent.method = ParseMethod(method).value();
    const v1::LocalizeOptions message = ToProto(sent, std::chrono::milliseconds(70));
    const auto back = FromProto(message);
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(*back, sent) << method;
    EXPECT_EQ(BudgetFromProto(message).value(), std::chrono::milliseconds(70));
  }
}

TEST(ConvertOptions, LeavesUnsetWhatIsNotGiven) {
  const auto back = FromProto(v1::LocalizeOptions());
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back, Query());
  EXPECT_EQ(BudgetFromProto(v1::LocalizeOptions()).value(), std::chrono::milliseconds(0));
}

TEST(ConvertOptions, RefusesWhatIsOutOfRange) {
  for (const double threshold : {kNan, -0.01, 1.01, HUGE_VAL}) {
    v1::LocalizeOptions message;
    message.set_threshold(threshold);
    ExpectInvalid(FromProto(message).status(), "options.threshold");
  }
  for (const int count : {0, -1, std::numeric_limits<int>::min(), limits::kMaxCandidates + 1}) {
    v1::LocalizeOptions message;
    message.set_num_candidates(count);
    ExpectInvalid(FromProto(message).status(), "options.num_candidates");
    message.Clear();
    message.set_max_answers(count);
    ExpectInvalid(FromProto(message).status(), "options.max_answers");
  }
}

TEST(ConvertOptions, RefusesAMethodThatIsNone) {
  v1::LocalizeOptions message;
  message.set_method(static_cast<v1::Method>(77));
  ExpectInvalid(FromProto(message).status(), "options.method is 77");
  message.set_method(v1::METHOD_AUTO);
  message.set_brute_force(true);
  ExpectInvalid(FromProto(message).status(), "options.brute_force");
}

TEST(ConvertMapName, RefusesAnEndlessName) {
  EXPECT_TRUE(CheckAskedMap("").ok());
  EXPECT_TRUE(CheckAskedMap(std::string(limits::kMaxNameBytes, 'n')).ok());
  ExpectInvalid(CheckAskedMap(std::string(limits::kMaxNameBytes + 1, 'n')), "map");
}

}  // namespace
}  // namespace scanloc::proto

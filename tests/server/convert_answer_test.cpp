#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "scanloc/core/limits.hpp"
#include "scanloc/proto/convert.hpp"
#include "support/same_answer.hpp"

namespace scanloc::proto {
namespace {

Candidate RandomCandidate(std::mt19937_64& random) {
  std::uniform_real_distribution<double> number(-3.0, 3.0);
  Candidate candidate;
  candidate.place = static_cast<std::int32_t>(random() >> 40);
  candidate.session = 1;
  candidate.session_name = "evening";
  if (random() % 2 == 0) candidate.map = "south";
  candidate.T_map_place =
      Pose(Eigen::Translation3d(1e6 * number(random), number(random), number(random))) *
      Eigen::AngleAxisd(number(random), Eigen::Vector3d(1, 2, 3).normalized());
  candidate.distance = std::abs(number(random)) / 3.0;
  if (random() % 2 == 0) candidate.confidence = std::abs(number(random)) / 3.0;
  candidate.yaw_rad = number(random);
  candidate.lateral_m = number(random);
  candidate.T_map_query =
      candidate.T_map_place * PlanarOffset(candidate.lateral_m, candidate.yaw_rad);
  if (random() % 2 == 0) {
    const PoseCovariance root = PoseCovariance::NullaryExpr([&] { return number(random); });
    candidate.covariance = MovedBy(Eigen::Vector3d::Ones(), root * root.transpose());
  }
  if (random() % 2 == 0) candidate.geo = GeoPose{48.0 + number(random), 11.0, 500.0, 359.0};
  return candidate;
}

LocalizeReply RandomReply(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  LocalizeReply reply;
  reply.map = "town";
  reply.queue_ns = 1;
  reply.decode_ns = 2;
  reply.answer.outcome = static_cast<Outcome>(1 + random() % 4);
  reply.answer.reason = "because";
  reply.answer.content_id = "abc";
  reply.answer.times = {.describe_ns = 3, .retrieve_ns = 4, .match_ns = 5};
  for (std::uint64_t i = 0; i < seed % 4; ++i) {
    reply.answer.candidates.push_back(RandomCandidate(random));
  }
  if (seed % 2 == 0) {
    reply.scan_counts =
        ScanCounts{.num_points = 9, .num_not_finite = 8, .num_beyond_limit = 7, .num_voxels = 6};
  }
  return reply;
}

TEST(ConvertReply, BringsAnswersBackAsTheyWere) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const LocalizeReply sent = RandomReply(seed);
    v1::LocalizeResponse wire;
    ASSERT_TRUE(wire.ParseFromString(ToProto(sent).SerializeAsString()));
    const auto back = FromProto(wire);
    ASSERT_TRUE(back.ok()) << back.status();
    test::ExpectSameAnswer(back->answer, sent.answer);
    EXPECT_EQ(back->map, sent.map);
    EXPECT_EQ(back->queue_ns, 1);
    EXPECT_EQ(back->decode_ns, 2);
    EXPECT_EQ(back->answer.times.describe_ns, 3);
    EXPECT_EQ(back->answer.times.retrieve_ns, 4);
    EXPECT_EQ(back->answer.times.match_ns, 5);
    EXPECT_EQ(back->scan_counts, sent.scan_counts);
  }
}

TEST(ConvertReply, RefusesWhatIsOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int number = 0;
  const auto refuses = [&](auto&& spoil) {
    v1::LocalizeResponse message = ToProto(RandomReply(3));
    ASSERT_EQ(message.candidates_size(), 3);
    spoil(message, *message.mutable_candidates(1));
    EXPECT_EQ(FromProto(message).status().code(), absl::StatusCode::kInvalidArgument)
        << "case " << number;
    ++number;
  };
  using Reply = v1::LocalizeResponse;
  using One = v1::Candidate;
  refuses([](Reply& m, One&) { m.set_outcome(v1::OUTCOME_UNSPECIFIED); });
  refuses([](Reply& m, One&) { m.set_outcome(static_cast<v1::Outcome>(77)); });
  refuses([](Reply& m, One&) { m.set_map(std::string(300, 'm')); });
  refuses([](Reply& m, One&) { m.set_reason(std::string(100'000, 'm')); });
  refuses([](Reply& m, One&) { m.set_content_id(std::string(300, 'm')); });
  refuses([](Reply& m, One&) {
    for (int i = 0; i < limits::kMaxCandidates; ++i) m.add_candidates();
  });
  refuses([](Reply&, One& c) { c.set_place(-1); });
  refuses([](Reply&, One& c) { c.set_session(-1); });
  refuses([](Reply&, One& c) { c.set_session_name(std::string(300, 's')); });
  refuses([&](Reply&, One& c) { c.set_distance(nan); });
  refuses([&](Reply&, One& c) { c.set_yaw_rad(nan); });
  refuses([&](Reply&, One& c) { c.set_lateral_m(1.0 / 0.0); });
  refuses([](Reply&, One& c) { c.set_confidence(1.5); });
  refuses([](Reply&, One& c) { c.clear_t_map_place(); });
  refuses([](Reply&, One& c) { c.mutable_t_map_query()->set_qw(3.0); });
  refuses([&](Reply&, One& c) { c.mutable_t_map_query()->set_x_m(nan); });
  refuses([&](Reply&, One& c) { c.mutable_t_map_query()->set_qx(nan); });
  refuses([](Reply&, One& c) { c.mutable_geo()->set_latitude_deg(90.1); });
  refuses([](Reply&, One& c) { c.mutable_geo()->set_heading_deg(-1.0); });
  refuses([&](Reply&, One& c) { c.mutable_geo()->set_altitude_m(nan); });
}

}  // namespace
}  // namespace scanloc::proto

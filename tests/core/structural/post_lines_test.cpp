#include "structural/post_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace scanloc {
namespace {

constexpr double kCell_m = 0.2;
constexpr double kInlier_m = 0.05;

Post PostAt(double x_m, double y_m) {
  return {static_cast<std::int16_t>(std::lround(100.0 * x_m)),
          static_cast<std::int16_t>(std::lround(100.0 * y_m))};
}

/// The four walls of a room about the sensor, and a cupboard in it; a post a cell, begun anywhere.
std::vector<Post> Room(double width_m, double depth_m, double begin_m, double cupboard_x_m) {
  std::vector<Post> posts;
  for (double x = -width_m / 2 + begin_m; x < width_m / 2; x += kCell_m) {
    posts.push_back(PostAt(x, -depth_m / 2));
    posts.push_back(PostAt(x, depth_m / 2));
  }
  for (double y = -depth_m / 2 + begin_m; y < depth_m / 2; y += kCell_m) {
    posts.push_back(PostAt(-width_m / 2, y));
    posts.push_back(PostAt(width_m / 2, y));
  }
  for (double y = begin_m; y < 1.0; y += kCell_m) posts.push_back(PostAt(cupboard_x_m, y));
  return posts;
}

double Ratio(const std::vector<Post>& query, const std::vector<Post>& place,
             const PlanarPose& T_place_query) {
  return PostLines(query, kCell_m)
      .InlierRatioOn(PostLines(place, kCell_m), T_place_query, kInlier_m);
}

TEST(PostLines, LieOnEachOtherWhereverTheirPostsStandOnTheWalls) {
  // Not in corners, where posts form no line.
  EXPECT_GT(Ratio(Room(6, 5, 0.02, 1), Room(6, 5, 0.13, 1), {}), 0.8);
}

TEST(PostLines, AreLaidOnEachOtherFromNearBy) {
  EXPECT_GT(Ratio(Room(6, 5, 0.02, 1), Room(6, 5, 0.13, 1), {0.08, -0.06, 0.02}), 0.8);
}

TEST(PostLines, TellARoomFromOneThatIsAlike) {
  const std::vector<Post> room = Room(6, 5, 0.02, 1);
  EXPECT_LT(Ratio(Room(6.2, 5.2, 0.07, 1), room, {}), 0.7);
  const double rearranged = Ratio(Room(6, 5, 0.07, -1.5), room, {});
  EXPECT_LT(rearranged, Ratio(Room(6, 5, 0.07, 1), room, {}));
  EXPECT_GT(rearranged, 0.8) << "the walls are the same";
}

TEST(PostLines, HaveNothingInCommonWithNothingOrWhatIsFarOff) {
  const std::vector<Post> room = Room(6, 5, 0.02, 1);
  EXPECT_EQ(Ratio({}, room, {}), 0.0);
  EXPECT_EQ(Ratio(room, {}, {}), 0.0);
  EXPECT_EQ(Ratio({}, {}, {}), 0.0);
  EXPECT_EQ(Ratio({PostAt(0.1, 0.1)}, {}, {}), 0.0) << "where the other's sensor is";
  EXPECT_EQ(Ratio(room, room, {1e12, 0.0, 0.0}), 0.0);
  EXPECT_EQ(Ratio(room, room, {std::numeric_limits<double>::infinity(), 0.0, 0.0}), 0.0);
}

TEST(PostLines, TakeTheWidestReachAndAsManyPostsAtOneSpotAsAFileMayHold) {
  std::vector<Post> wide = {PostAt(-300, -300), PostAt(300, 300)};
  EXPECT_EQ(Ratio(wide, wide, {}), 1.0);
  const std::vector<Post> same(Structure::kMaxPosts, PostAt(1, 1));
  EXPECT_EQ(Ratio(same, same, {}), 1.0);
}

}  // namespace
}  // namespace scanloc

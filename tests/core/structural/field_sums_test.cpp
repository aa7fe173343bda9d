#include "structural/field_sums.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "structural/horizon.hpp"

namespace scanloc::field_sums {
namespace {

std::vector<Post> RandomPosts(std::mt19937_64& random, std::size_t count, int reach_cm) {
  const auto coordinate = [&] {
    return static_cast<std::int16_t>(static_cast<int>(random() % (2 * reach_cm)) - reach_cm);
  };
  std::vector<Post> posts;
  for (std::size_t i = 0; i < count; ++i) posts.push_back({coordinate(), coordinate()});
  return posts;
}

TEST(FieldSums, AreTheSameBitsByEachKernel) {
  const std::vector<Kernels> all = All();
  const Kernels& portable = all.back();
  std::mt19937_64 random(1);
  for (const double cell_m : {0.25, 0.5, 1.0}) {
    DistanceField field(cell_m, 60.0, 3.0);
    const std::vector<Post> query = RandomPosts(random, 300, 5000);
    field.Fill(PlanarPoints(query));
    const Horizon horizon(query, 4.0);
    for (const std::size_t num_points : {0, 1, 7, 8, 9, 16, 17, 24, 80, 250, 1001}) {
      // Some of these lie beyond the field.
      const PlanarPoints points(RandomPosts(random, num_points, 9000));
      const Placed placed(field, {0.01 * static_cast<double>(random() % 1000), -1.5,
                                  0.01 * static_cast<double>(random() % 628)});
      const float* const x_m = points.x_m().data();
      const float* const y_m = points.y_m().data();
      const std::size_t num = points.x_m().size();
      Sums expected;
      portable.add_up(placed, 1.5F, x_m, y_m, num, expected);
      const float overlap = portable.overlap(placed, 1e-8F, x_m, y_m, num);
      const float* const reach = horizon.reach_squared_m().data();
      const InSight within = portable.overlap_within(placed, reach, 1e-8F, x_m, y_m, num);
      for (const Kernels& kernels : all) {
        SCOPED_TRACE(kernels.name);
        Sums sums;
        kernels.add_up(placed, 1.5F, x_m, y_m, num, sums);
        EXPECT_EQ(sums, expected) << num_points;
        EXPECT_EQ(kernels.overlap(placed, 1e-8F, x_m, y_m, num), overlap) << num_points;
        const InSight seen = kernels.overlap_within(placed, reach, 1e-8F, x_m, y_m, num);
        EXPECT_EQ(seen.overlap, within.overlap) << num_points;
        EXPECT_EQ(seen.num_points, within.num_points) << num_points;
      }
    }
  }
}

}  // namespace
}  // namespace scanloc::field_sums

#include "scanloc/eval/vector_baseline.hpp"

#include <gtest/gtest.h>

#include "support/small_evaluation.hpp"

namespace scanloc::eval {
namespace {

using test::SmallEvaluation;

Answer Ask(ComputedDescriptors* baseline, std::size_t query, std::size_t num_places) {
  static Map map;
  map.places.assign(num_places, {});
  baseline->Prepare(map, {});
  const ScanDescriptor descriptor;
  return baseline->Recognize(
      {.scan = {}, .descriptor = descriptor, .number = query, .num_answers = 10});
}

TEST(ComputedDescriptors, AreComparedByTheDistanceThatIsAskedFor) {
  const std::vector<Eigen::VectorXf> queries = {Eigen::Vector2f(0, 0), Eigen::Vector2f(10, 0)};
  const std::vector<Eigen::VectorXf> places = {Eigen::Vector2f(1, 0), Eigen::Vector2f(9, 9),
                                               Eigen::Vector2f(0, 0)};
  ComputedDescriptors by_l2("net", VectorDistance::kL2, queries, places);
  EXPECT_FALSE(by_l2.needs_place_scans());
  EXPECT_EQ(by_l2.name(), "net");
  const Answer near = Ask(&by_l2, 1, 3);
  ASSERT_EQ(near.candidates.size(), 2U) << "a zero vector is like no other";
  EXPECT_EQ(near.candidates[0].place, 0);
  EXPECT_NEAR(near.candidates[0].distance, 9.0, 1e-6);
  EXPECT_NEAR(near.candidates[1].distance, std::sqrt(82.0), 1e-5);
  EXPECT_TRUE(Ask(&by_l2, 0, 3).candidates.empty());

  ComputedDescriptors by_angle("net", VectorDistance::kCosine, queries, places);
  const Answer alike = Ask(&by_angle, 1, 3);
  ASSERT_EQ(alike.candidates.size(), 2U);
  EXPECT_EQ(alike.candidates[0].place, 0);
  EXPECT_NEAR(alike.candidates[0].distance, 0.0, 1e-6);
  EXPECT_NEAR(alike.candidates[1].distance, 1.0 - std::sqrt(0.5), 1e-6);
}

TEST(ComputedDescriptors, AreJudgedAsTheOthers) {
  SmallEvaluation small;
  std::vector<Eigen::VectorXf> queries, places;
  for (int i = 0; i < SmallEvaluation::kNumPlaces; ++i) {
    places.emplace_back(Eigen::Vector2f(1.0F, 10.0F * static_cast<float>(i)));
    queries.emplace_back(Eigen::Vector2f(1.0F, 10.0F * static_cast<float>(i) + 1.0F));
  }
  queries.emplace_back(Eigen::Vector2f(900.0F, -900.0F));
  // One query is taken for a place of elsewhere.
  queries[2] = places[6];
  small.options.read_place = nullptr;
  small.options.baselines = {std::make_shared<ComputedDescriptors>(
      "net", VectorDistance::kL2, std::move(queries), std::move(places))};
  small.options.methods = {
      {.name = "net", .method = {}, .num_candidates = {}, .is_baseline = true, .baseline = "net"}};
  FindRevisits(small.localizer->map(), 8.0, &small.queries);
  const auto results = Evaluate(*small.localizer, small.queries, small.options, [](std::size_t) {});
  ASSERT_TRUE(results.ok()) << results.status();
  const MethodResult& result = results->front();
  constexpr auto kNum = std::size_t{SmallEvaluation::kNumPlaces};
  EXPECT_EQ(result.first_right.size(), kNum);
  for (std::size_t i = 0; i < kNum; ++i) EXPECT_EQ(result.scored[i].is_right, i != 2) << i;
}

}  // namespace
}  // namespace scanloc::eval

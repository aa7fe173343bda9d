#include <gtest/gtest.h>

#include <cmath>

#include "scanloc/eval/vector_baseline.hpp"

namespace scanloc::eval {
namespace {

TEST(VectorIndex, FindsTheNearestAndPassesOverTheExcluded) {
  VectorIndex index;
  for (const float value : {5.0F, 1.0F, 3.0F, 1.0F}) index.Add(Eigen::VectorXf::Constant(2, value));
  const Eigen::VectorXf query = Eigen::VectorXf::Constant(2, 1.5F);
  const auto numbers = [&](std::size_t k, const std::vector<bool>* excluded = nullptr) {
    std::vector<std::size_t> found;
    for (const auto& neighbor : index.Search(query, k, excluded)) found.push_back(neighbor.number);
    return found;
  };
  EXPECT_EQ(numbers(2), (std::vector<std::size_t>{1, 3}));
  EXPECT_EQ(numbers(10), (std::vector<std::size_t>{1, 3, 2, 0}));
  const std::vector<bool> excluded = {false, true, false, true};
  EXPECT_EQ(numbers(10, &excluded), (std::vector<std::size_t>{2, 0}));
  EXPECT_NEAR(index.Search(query, 1).front().distance, std::sqrt(0.5), 1e-6);
  EXPECT_TRUE(VectorIndex().Search(query, 3).empty());
}

TEST(VectorIndex, NeverMatchesWhatCouldNotBeDescribed) {
  VectorIndex index;
  index.Add(Eigen::VectorXf::Zero(2));
  index.Add(Eigen::VectorXf::Ones(2));
  EXPECT_TRUE(index.Search(Eigen::VectorXf::Zero(2), 5).empty());
  const auto found = index.Search(Eigen::VectorXf::Constant(2, 0.1F), 5);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].number, 1U);
}

}  // namespace
}  // namespace scanloc::eval

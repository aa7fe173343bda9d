#include "scanloc/core/scan_context/match.hpp"

#include <gtest/gtest.h>

#include <random>

#include "scanloc/core/scan/descriptor.hpp"
#include "support/brute_force.hpp"

namespace scanloc {
namespace {

struct Sample {
  Context context;
  Keys keys;
  [[nodiscard]] ContextView view() const {
    return {context.num_rows, context.num_cols, context.cells_cm, keys.aligning_cm};
  }
};

/// A context of which some columns and many cells are empty.
Sample RandomSample(std::mt19937_64& random, int num_rows, int num_cols) {
  Sample sample{{num_rows, num_cols, {}}, {}};
  for (int c = 0; c < num_cols; ++c) {
    const bool empty_column = random() % 4 == 0;
    for (int r = 0; r < num_rows; ++r) {
      const bool empty = empty_column || random() % 2 == 0;
      sample.context.cells_cm.push_back(
          empty ? 0 : static_cast<std::uint16_t>(random() % (Context::kMaxHeight_cm + 1)));
    }
  }
  sample.keys = MakeKeys(sample.context);
  return sample;
}

Sample FromColumns(int num_rows, std::vector<std::uint16_t> cells_cm) {
  Sample sample{{num_rows, static_cast<int>(cells_cm.size()) / num_rows, std::move(cells_cm)}, {}};
  sample.keys = MakeKeys(sample.context);
  return sample;
}

/// The context whose column j + shift is column j of the given one, round the edge.
Sample Turned(const Sample& sample, int shift) {
  std::vector<std::uint16_t> cells(sample.context.cells_cm.size());
  const int num_rows = sample.context.num_rows;
  const int num_cols = sample.context.num_cols;
  for (int j = 0; j < num_cols; ++j) {
    for (int r = 0; r < num_rows; ++r) {
      cells[((j + shift + num_cols) % num_cols) * num_rows + r] = sample.context.At(r, j);
    }
  }
  return FromColumns(num_rows, cells);
}

TEST(ShiftedDistance, AgreesWithTheReferenceForEveryShift) {
  std::mt19937_64 random(17);
  for (const auto& [num_rows, num_cols] : {std::pair{20, 60}, {40, 40}, {1, 2}, {70, 8}}) {
    const Sample query = RandomSample(random, num_rows, num_cols);
    const Sample place = RandomSample(random, num_rows, num_cols);
    for (const ShiftMode mode : {ShiftMode::kCircular, ShiftMode::kBounded}) {
      for (int shift = -num_cols + 1; shift < num_cols; ++shift) {
        ASSERT_NEAR(ShiftedDistance(query.view(), place.view(), shift, mode),
                    brute_force::Distance(query.view(), place.view(), shift, mode), 1e-12)
            << num_rows << " × " << num_cols << ", shift " << shift;
      }
    }
  }
}

TEST(ShiftedDistance, IsExactAtTheGreatestHeights) {
  const Sample full = FromColumns(100, std::vector<std::uint16_t>(400, Context::kMaxHeight_cm));
  EXPECT_NEAR(ShiftedDistance(full.view(), full.view(), 0, ShiftMode::kCircular), 0.0, 1e-15);
}

TEST(ShiftedDistance, CountsAColumnThatOnlyOneSideHas) {
  const Sample two = FromColumns(2, {10, 20, 30, 40, 0, 0});
  const Sample one = FromColumns(2, {10, 20, 0, 0, 0, 0});
  EXPECT_DOUBLE_EQ(ShiftedDistance(one.view(), two.view(), 0, ShiftMode::kCircular), 0.5);
  EXPECT_DOUBLE_EQ(ShiftedDistance(two.view(), one.view(), 0, ShiftMode::kCircular), 0.5);
}

TEST(ShiftedDistance, IsGreatestWhereNothingCanBeCompared) {
  const Sample empty = FromColumns(2, {0, 0, 0, 0});
  const Sample full = FromColumns(2, {1, 2, 3, 4});
  EXPECT_EQ(ShiftedDistance(empty.view(), empty.view(), 0, ShiftMode::kCircular), 1.0);
  EXPECT_EQ(ShiftedDistance(empty.view(), full.view(), 1, ShiftMode::kBounded), 1.0);
}

TEST(Align, FindsEveryTurnOfACircularContext) {
  std::mt19937_64 random(3);
  const Sample query = RandomSample(random, 20, 60);
  const AlignOptions options{ShiftMode::kCircular, 0, 0};
  for (int shift = 0; shift < 60; ++shift) {
    const Sample place = Turned(query, shift);
    for (const Match& match : {AlignByKey(query.view(), place.view(), options),
                               AlignNaively(query.view(), place.view(), options)}) {
      EXPECT_EQ(match.shift, shift);
      EXPECT_NEAR(match.distance, 0.0, 1e-12);
    }
  }
}

TEST(Align, KeepsABoundedShiftWithinItsBounds) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 50; ++i) {
    const Sample query = RandomSample(random, 4, 10);
    const Sample place = RandomSample(random, 4, 10);
    const AlignOptions options{ShiftMode::kBounded, 3, 2};
    EXPECT_LE(std::abs(AlignByKey(query.view(), place.view(), options).shift), 3);
    EXPECT_LE(std::abs(AlignNaively(query.view(), place.view(), options).shift), 3);
  }
}

TEST(Align, IsNeverBetterThanTheNaiveAlignmentAndEqualsItInAFullNeighbourhood) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 30; ++i) {
    const Sample query = RandomSample(random, 8, 12);
    const Sample place = RandomSample(random, 8, 12);
    for (const ShiftMode mode : {ShiftMode::kCircular, ShiftMode::kBounded}) {
      const AlignOptions tight{mode, 5, 0};
      const AlignOptions wide{mode, 5, 20};
      const double naive = AlignNaively(query.view(), place.view(), tight).distance;
      EXPECT_GE(AlignByKey(query.view(), place.view(), tight).distance, naive);
      const Match match = AlignByKey(query.view(), place.view(), wide);
      EXPECT_EQ(match.distance, naive);
      EXPECT_EQ(ShiftedDistance(query.view(), place.view(), match.shift, mode), naive);
    }
  }
}

TEST(Align, GivesTheShiftOfLeastKeyDistance) {
  const Sample query = FromColumns(1, {0, 0, 7, 9, 0, 0});
  const Sample place = FromColumns(1, {0, 0, 0, 0, 7, 9});
  EXPECT_EQ(PreAlign(query.view(), place.view(), {ShiftMode::kCircular, 0, 0}), 2);
  EXPECT_EQ(PreAlign(query.view(), place.view(), {ShiftMode::kBounded, 4, 0}), 2);
  EXPECT_EQ(PreAlign(place.view(), query.view(), {ShiftMode::kBounded, 4, 0}), -2);
}

TEST(MakeKeys, SumsRowsAndColumns) {
  const Sample sample = FromColumns(2, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(sample.keys.retrieval_cm, (std::vector<std::int32_t>{9, 12}));
  EXPECT_EQ(sample.keys.aligning_cm, (std::vector<std::int32_t>{3, 7, 11}));
}

}  // namespace
}  // namespace scanloc

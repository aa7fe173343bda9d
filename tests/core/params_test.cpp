#include "scanloc/core/params.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "scanloc/core/method.hpp"

namespace scanloc {
namespace {

TEST(Params, DefaultsAreThePapersTable) {
  const Params params;
  EXPECT_TRUE(Validate(params).ok());
  EXPECT_EQ(params.voxel_size_m, 0.5);
  EXPECT_EQ(params.polar.num_rings, 20);
  EXPECT_EQ(params.polar.num_sectors, 60);
  EXPECT_EQ(params.polar.max_range_m, 80.0);
  EXPECT_EQ(params.polar.root_shifts_m, (std::vector<double>{2.0, -2.0}));
  EXPECT_EQ(params.cart.num_rows, 40);
  EXPECT_EQ(params.cart.num_cols, 40);
  EXPECT_EQ(params.cart.max_x_m, 100.0);
  EXPECT_EQ(params.cart.max_y_m, 40.0);
  EXPECT_TRUE(params.cart.double_flip);
  EXPECT_EQ(params.search.num_candidates, 1);
}

TEST(ValidateParams, NamesTheBadField) {
  const struct {
    const char* field;
    std::function<void(Params&)> spoil;
  } cases[] = {
      {"voxel_size_m", [](Params& p) { p.voxel_size_m = 0.0; }},
      {"voxel_size_m", [](Params& p) { p.voxel_size_m = std::nan(""); }},
      {"sensor_height_m", [](Params& p) { p.sensor_height_m = INFINITY; }},
      {"polar.num_rings", [](Params& p) { p.polar.num_rings = 0; }},
      {"polar.num_rings", [](Params& p) { p.polar.num_rings = 1'000'000; }},
      {"polar.num_sectors", [](Params& p) { p.polar.num_sectors = 61; }},
      {"polar.max_range_m", [](Params& p) { p.polar.max_range_m = -1; }},
      {"polar.root_shifts_m", [](Params& p) { p.polar.root_shifts_m = {std::nan("")}; }},
      {"polar.root_shifts_m", [](Params& p) { p.polar.root_shifts_m.assign(100, 1.0); }},
      {"cart.num_rows", [](Params& p) { p.cart.num_rows = 41; }},
      {"cart.num_cols", [](Params& p) { p.cart.num_cols = 0; }},
      {"cart.max_x_m", [](Params& p) { p.cart.max_x_m = 1e9; }},
      {"cart.max_y_m", [](Params& p) { p.cart.max_y_m = 0; }},
      {"cart.shift_mode", [](Params& p) { p.cart.shift_mode = static_cast<ShiftMode>(9); }},
      {"cart.max_shift_cols", [](Params& p) { p.cart.max_shift_cols = 40; }},
      {"polar.enabled", [](Params& p) { p.polar.enabled = p.cart.enabled = false; }},
      {"search.num_candidates", [](Params& p) { p.search.num_candidates = 0; }},
      {"search.align_radius", [](Params& p) { p.search.align_radius = -1; }},
      {"search.polar_threshold", [](Params& p) { p.search.polar_threshold = 1.1; }},
      {"search.cart_threshold", [](Params& p) { p.search.cart_threshold = std::nan(""); }},
      {"search.min_voxels", [](Params& p) { p.search.min_voxels = 0; }},
      {"auto.posts.voxel_m", [](Params& p) { p.automatic.posts.voxel_m = 0.001; }},
      {"auto.posts.reach_m", [](Params& p) { p.automatic.posts.cell_m = 0.05; }},
      {"auto.ground.reach_m", [](Params& p) { p.automatic.ground.cell_m = 20.0; }},
      {"auto.verify.fine_cell_m", [](Params& p) { p.automatic.verify.fine_cell_m = 5.0; }},
  };
  for (const auto& test : cases) {
    Params params;
    test.spoil(params);
    const absl::Status status = Validate(params);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << test.field;
    EXPECT_NE(std::string(status.message()).find(test.field), std::string::npos) << status;
  }
}

TEST(DescriptorSignature, ChangesWithWhatShapesAQueryAndOnlyWithThat) {
  const Params params;
  Params other = params;
  other.search.num_candidates = 10;
  other.polar.root_shifts_m = {4.0};
  other.automatic.verify.cutoff_m = 2.0;
  EXPECT_EQ(DescriptorSignature(params), DescriptorSignature(other));
  const std::function<void(Params&)> changes[] = {
      [](Params& p) { p.voxel_size_m = 0.4; },
      [](Params& p) { p.sensor_height_m = 1.7; },
      [](Params& p) { p.polar.num_rings = 40; },
      [](Params& p) { p.polar.num_sectors = 120; },
      [](Params& p) { p.polar.max_range_m = 81.0; },
      [](Params& p) { p.cart.num_rows = 20; },
      [](Params& p) { p.cart.num_cols = 20; },
      [](Params& p) { p.cart.max_x_m = 90.0; },
      [](Params& p) { p.cart.max_y_m = 30.0; },
      [](Params& p) { p.cart.enabled = false; },
      [](Params& p) { p.polar.enabled = false; },
      [](Params& p) { p.automatic.posts.min_extent_m = 0.5; },
      [](Params& p) { p.automatic.ground.wide_m = 0.5; },
  };
  for (const auto& change : changes) {
    Params changed = params;
    change(changed);
    EXPECT_NE(DescriptorSignature(params), DescriptorSignature(changed));
  }
}

TEST(AutoParamsAtScale, AreValidAtAnyAndTheDefaultsAtOne) {
  EXPECT_EQ(AutoParamsAtScale(1.0), AutoParams());
  for (const double scale : {0.0, kMinScale, 0.25, 0.5, 2.0, kMaxScale, 1e9}) {
    Params params;
    params.automatic = AutoParamsAtScale(scale);
    EXPECT_TRUE(Validate(params).ok()) << scale << ": " << Validate(params);
    EXPECT_NE(params.automatic, AutoParams());
  }
  EXPECT_EQ(AutoParamsAtScale(0.5).posts.reach_m, 30.0);
  EXPECT_EQ(AutoParamsAtScale(0.5).posts.voxel_m, 0.25);
}

TEST(VisitFields, NamesEveryFieldOnce) {
  Params params;
  std::set<std::string> names;
  int count = 0;
  VisitFields(params, [&](const char* name, auto&) {
    names.insert(name);
    ++count;
  });
  EXPECT_EQ(count, 22 + 121);
  EXPECT_EQ(names.size(), 22U + 121U);
}

TEST(Method, NamesAreReadBack) {
  for (const char* name : {"auto", "pc", "cc", "a-pc", "a-cc", "pc-naive", "a-cc-brute",
                           "a-pc-naive-brute", "cc-naive-brute"}) {
    const auto method = ParseMethod(name);
    ASSERT_TRUE(method.ok()) << name;
    EXPECT_EQ(MethodName(*method), name);
  }
}

TEST(Method, UnknownNamesAreRefused) {
  const std::string long_name(5000, 'x');
  for (const char* name : {"", "p", "PC", "a-auto", "auto-brute", "a-", "a-a-pc", "pc-brute-naive",
                           "pc ", "-brute", long_name.c_str()}) {
    const auto method = ParseMethod(name);
    EXPECT_EQ(method.status().code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_LT(method.status().message().size(), 300U);
  }
}

TEST(Method, DefaultIsAutoWhereThereAreStructuresElseTheAugmentedPolarContext) {
  Params params;
  EXPECT_EQ(MethodName(DefaultMethod(params)), "auto");
  params.structure.enabled = false;
  EXPECT_EQ(MethodName(DefaultMethod(params)), "a-pc");
  params.polar.enabled = false;
  EXPECT_EQ(MethodName(DefaultMethod(params)), "a-cc");
}

}  // namespace
}  // namespace scanloc

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <type_traits>

#include "scanloc/core/auto_fields.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/proto/convert.hpp"

namespace scanloc::proto {
namespace {

/// Gives every field a value that is neither its default nor another field's.
Params DistinctParams() {
  Params params;
  params.polar.enabled = true;
  int next = 3;
  VisitFields(params, [&](std::string_view /*name*/, auto& field) {
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_same_v<Field, bool>) {
      field = !field;
    } else if constexpr (std::is_same_v<Field, int>) {
      field = 2 * next++;
    } else if constexpr (std::is_same_v<Field, double>) {
      field = 1.0 / next++ + 1.0;
    } else if constexpr (std::is_same_v<Field, ShiftMode>) {
      field = ShiftMode::kCircular;
    } else {
      field = {1.0 / next, -1.0 / next, 0.5};
    }
  });
  params.automatic = {};
  VisitAutoFields(
      params.automatic, [&](std::string_view /*name*/, auto& field, auto /*least*/, auto most) {
        const double step = std::is_same_v<std::decay_t<decltype(field)>, int> ? 1.0 : 0.05;
        const double raised = static_cast<double>(field) + step;
        field += static_cast<std::decay_t<decltype(field)>>(raised > most ? -step : step);
      });
  params.polar.enabled = true;  // both kinds disabled would be refused
  params.cart.max_shift_cols = 3;
  params.search.polar_threshold = 1.0 / 3.0;
  params.search.cart_threshold = 2.0 / 3.0;
  params.search.min_confidence = 0.7;
  return params;
}

MapInfo MakeInfo() {
  return {.name = "town",
          .content_id = "abc",
          .params = DistinctParams(),
          .sessions = {"morning", "", "été"},
          .num_places = 12345,
          .extent = Box{.min_m = {-1.1, -2.2, -3.3}, .max_m = {4.4, 5.5, 6.6}},
          .generation = 7,
          .geo_origin = GeoOrigin{48.0, 11.0, 500.0, 12.0, {1.0, 2.0, 3.0}}};
}

TEST(ConvertParams, BringsEveryFieldBackAsItWas) {
  const Params sent = DistinctParams();
  ASSERT_TRUE(Validate(sent).ok()) << Validate(sent);
  const auto back = FromProto(ToProto(sent));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back, sent);
  EXPECT_EQ(DescriptorSignature(*back), DescriptorSignature(sent));
}

TEST(ConvertParams, RefusesWhatValidateRefuses) {
  Params bad;
  bad.polar.num_sectors = 61;
  EXPECT_EQ(FromProto(ToProto(bad)).status().code(), absl::StatusCode::kInvalidArgument);
  bad = {};
  bad.voxel_size_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FromProto(ToProto(bad)).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ConvertParams, RefusesParamsThatLackAPart) {
  EXPECT_FALSE(FromProto(v1::Params()).ok());
  v1::Params message = ToProto(Params());
  message.clear_search();
  EXPECT_FALSE(FromProto(message).ok());
  message = ToProto(Params());
  message.mutable_auto_params()->RemoveLast();
  EXPECT_FALSE(FromProto(message).ok());
}

TEST(ConvertParams, PassesOverNumbersOfANewerServer) {
  v1::Params message = ToProto(Params());
  message.add_auto_params()->set_name("auto.posts.younger");
  EXPECT_EQ(*FromProto(message), Params());
}

TEST(ConvertParams, RefusesAShiftModeThatIsNone) {
  for (const int mode : {0, 3, -1, 1 << 30}) {
    v1::Params message = ToProto(Params());
    message.mutable_cart()->set_shift_mode(static_cast<v1::ShiftMode>(mode));
    EXPECT_EQ(FromProto(message).status().code(), absl::StatusCode::kInvalidArgument) << mode;
  }
}

TEST(ConvertMapInfo, BringsAMapBackAsItWas) {
  const auto back = FromProto(ToProto(MakeInfo()));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back, MakeInfo());
}

TEST(ConvertMapInfo, BringsAMapWithoutPlacesBack) {
  MapInfo info = MakeInfo();
  info.num_places = 0;
  info.extent.reset();
  const auto back = FromProto(ToProto(info));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back, info);
}

TEST(ConvertMapInfo, RefusesWhatIsOutOfRange) {
  const auto refuses = [](auto&& spoil) {
    v1::MapInfo message = ToProto(MakeInfo());
    spoil(message);
    EXPECT_EQ(FromProto(message).status().code(), absl::StatusCode::kInvalidArgument);
  };
  refuses([](v1::MapInfo& m) { m.set_name(std::string(300, 'n')); });
  refuses([](v1::MapInfo& m) { m.set_content_id(std::string(300, 'n')); });
  refuses([](v1::MapInfo& m) { m.add_sessions(std::string(300, 'n')); });
  refuses([](v1::MapInfo& m) { m.set_num_places(-1); });
  refuses([](v1::MapInfo& m) { m.mutable_geo_origin()->set_longitude_deg(1000.0); });
  refuses([](v1::MapInfo& m) { m.set_num_places(limits::kMaxPlaces + 1); });
  refuses([](v1::MapInfo& m) { m.mutable_extent()->set_max_z_m(1.0 / 0.0); });
  refuses([](v1::MapInfo& m) { m.clear_params(); });
}

TEST(ConvertMapList, BringsTheListBackAsItWas) {
  const std::vector<MapSummary> sent = {{.name = "a",
                                         .state = MapState::kServing,
                                         .content_id = "id",
                                         .num_places = 9,
                                         .generation = 2},
                                        {.name = "b",
                                         .state = MapState::kLoading,
                                         .content_id = "",
                                         .num_places = 0,
                                         .generation = 0}};
  const auto back = FromProto(ToProto(sent));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*back, sent);
}

TEST(ConvertMapList, RefusesAStateThatIsNone) {
  v1::ListMapsResponse message;
  message.add_maps()->set_name("a");
  EXPECT_EQ(FromProto(message).status().code(), absl::StatusCode::kInvalidArgument);
  message.mutable_maps(0)->set_state(static_cast<v1::MapState>(99));
  EXPECT_EQ(FromProto(message).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace scanloc::proto

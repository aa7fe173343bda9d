#include "scanloc/report/map_picture.hpp"

#include <gtest/gtest.h>

#include "svg.hpp"

namespace scanloc::report {
namespace {

using Eigen::Vector2d;

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) {
    ++count;
  }
  return count;
}

std::vector<PicturedPlace> Street(int num_places, double y_m, std::size_t session) {
  std::vector<PicturedPlace> places;
  for (int i = 0; i < num_places; ++i) places.push_back({Vector2d(2.0 * i, y_m), session});
  return places;
}

TEST(Svg, EscapesText) {
  Svg svg({10.0, 10.0});
  svg.Text({1.0, 2.0}, "<a & \"b\">\x01", {});
  const std::string document = svg.Finish();
  EXPECT_NE(document.find(">&lt;a &amp; &quot;b&quot;&gt;\\x01</text>"), std::string::npos)
      << document;
}

TEST(Svg, WritesShortNumbers) {
  std::string path;
  AppendMove({1.0, 2.5}, &path);
  AppendLine({1.0 / 3.0, -1e-9}, &path);
  EXPECT_EQ(path, "M1 2.5L0.33 0");
}

TEST(MapPicture, DrawsOnePathAStretch) {
  std::vector<PicturedPlace> places = Street(10, 0.0, 0);
  const auto append = [&](const std::vector<PicturedPlace>& more) {
    places.insert(places.end(), more.begin(), more.end());
  };
  EXPECT_EQ(Count(DrawMapPicture("", places, {}), "h0"), 1);
  append(Street(10, 100.0, 0));
  EXPECT_EQ(Count(DrawMapPicture("", places, {}), "h0"), 2) << "a jump breaks the path";
  append(Street(10, 100.0, 1));
  EXPECT_EQ(Count(DrawMapPicture("", places, {}), "h0"), 3) << "so does a new session";
}

TEST(MapPicture, ShowsEachVerdictOnce) {
  const std::vector<PicturedQuery> queries = {
      {"r.bin", Verdict::kRight, Vector2d(1.0, 0.0), Vector2d(1.0, 1.0)},
      {"w.bin", Verdict::kWrong, Vector2d(2.0, 0.0), Vector2d(9.0, 0.0)},
      {"u.bin", Verdict::kUnchecked, Vector2d(3.0, 0.0), std::nullopt},
      {"a.bin", Verdict::kAmbiguous, Vector2d(3.5, 0.0), std::nullopt},
      {"n.bin", Verdict::kNotRecognized, Vector2d(4.0, 0.0), Vector2d(5.0, 0.0)},
      {"nowhere.bin", Verdict::kNotRecognized, std::nullopt, std::nullopt},
  };
  const std::string picture = DrawMapPicture("the <title>", Street(10, 0.0, 0), queries);
  EXPECT_EQ(Count(picture, "r.bin: right"), 1);
  EXPECT_EQ(Count(picture, "w.bin: wrong"), 1);
  EXPECT_EQ(Count(picture, "u.bin: localized"), 1);
  EXPECT_EQ(Count(picture, "a.bin: ambiguous"), 1);
  EXPECT_EQ(Count(picture, "ambiguous: 1"), 1);
  EXPECT_EQ(Count(picture, "n.bin: not recognised"), 1);
  EXPECT_EQ(Count(picture, "nowhere.bin"), 0);
  EXPECT_EQ(Count(picture, "not recognised: 2"), 1) << "but it is counted";
  EXPECT_EQ(Count(picture, "the &lt;title&gt;"), 1);
}

TEST(MapPicture, SaysNothingOfAnswersWhereThereAreNone) {
  const std::string picture = DrawMapPicture("", Street(10, 0.0, 0), {});
  EXPECT_EQ(Count(picture, "map: 10 places"), 1);
  for (const char* word : {"right", "wrong", "ambiguous", "not recognised"}) {
    EXPECT_EQ(Count(picture, word), 0) << word;
  }
}

TEST(MapPicture, StandsWithLittleOrFarAway) {
  for (const std::vector<PicturedPlace>& places :
       {std::vector<PicturedPlace>{}, Street(1, 0.0, 0), Street(2, 5.0e6, 0), Street(3, -7.0e7, 0),
        Street(20'000, 0.0, 0)}) {
    const std::string picture = DrawMapPicture("", places, {});
    EXPECT_EQ(Count(picture, "</svg>\n"), 1);
    EXPECT_EQ(Count(picture, "nan"), 0);
    EXPECT_EQ(Count(picture, "inf"), 0);
    EXPECT_GE(Count(picture, "text-anchor=\"end\""), 2) << "numbers at the axis";
    EXPECT_LE(Count(picture, "text-anchor=\"end\""), 40);
  }
}

}  // namespace
}  // namespace scanloc::report

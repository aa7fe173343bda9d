#include "encoding.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "scanloc/core/scan/descriptor.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {
namespace {

using testing::HasSubstr;

TEST(Params, ComeBackFromTheirTextsWithTheSameBits) {
  Params params;
  params.voxel_size_m = 0.1 + 0.2;
  params.sensor_height_m = -1.0 / 3.0;
  params.polar.root_shifts_m = {1e-300, -0.1, 2.0, 1.0 / 7.0};
  params.cart.shift_mode = ShiftMode::kCircular;
  params.cart.double_flip = false;
  params.search.min_voxels = 123456;
  const auto decoded = DecodeParams(EncodeParams(params), schema::kVersion);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, params);
  params.polar.root_shifts_m.clear();
  EXPECT_EQ(*DecodeParams(EncodeParams(params), schema::kVersion), params);
}

TEST(Params, AreRefusedWhereATextIsMissingOrMalformed) {
  const ParamTexts good = EncodeParams(Params());
  for (std::size_t i = 0; i < good.size(); ++i) {
    ParamTexts texts = good;
    for (const std::string bad : {"x", " 1", "1 ", "0x1", "1,,2", "99999999999999999999"}) {
      texts[i].second = bad;
      EXPECT_EQ(DecodeParams(texts, schema::kVersion).status().code(),
                absl::StatusCode::kInvalidArgument)
          << texts[i].first << " = " << bad;
    }
    texts.erase(texts.begin() + static_cast<std::ptrdiff_t>(i));
    const absl::Status status = DecodeParams(texts, schema::kVersion).status();
    EXPECT_THAT(std::string(status.message()), HasSubstr(good[i].first + " is missing"));
  }
}

TEST(Params, AreRefusedOutOfTheirRange) {
  for (const std::string value : {"nan", "inf", "-1", "1e300"}) {
    ParamTexts texts = EncodeParams(Params());
    for (auto& [name, text] : texts) {
      if (name == "voxel_size_m") text = value;
    }
    EXPECT_FALSE(DecodeParams(texts, schema::kVersion).ok()) << value;
  }
}

TEST(Params, OfUnknownNamesArePassedOver) {
  ParamTexts texts = EncodeParams(Params());
  texts.emplace_back("zeal", "7");
  EXPECT_EQ(*DecodeParams(texts, schema::kVersion), Params());
}

TEST(Params, OfSchema2KnewNoNumbersOfAuto) {
  ParamTexts texts = EncodeParams(Params());
  std::erase_if(texts, [](const auto& text) { return text.first.starts_with("auto."); });
  EXPECT_FALSE(DecodeParams(texts, 3).ok());
  const auto decoded = DecodeParams(texts, 2);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  Params expected;
  expected.automatic.verify.heights_share = 0.0;
  expected.automatic.evidence.equal_floors = 0.0;
  EXPECT_EQ(*decoded, expected);
}

TEST(Params, OfSchema12AskAsMuchOfAMirrorImageAsOfARival) {
  Params indoors;
  indoors.automatic = AutoParamsAtScale(0.35);
  ParamTexts texts = EncodeParams(indoors);
  std::erase_if(texts,
                [](const auto& text) { return text.first == "auto.evidence.equal_of_mirror"; });
  EXPECT_FALSE(DecodeParams(texts, 13).ok());
  const auto decoded = DecodeParams(texts, 12);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_NE(*decoded, indoors);
  indoors.automatic.evidence.equal_of_mirror = 1.0;
  EXPECT_EQ(*decoded, indoors);
}

TEST(Params, OfSchema1KnewNoStructures) {
  ParamTexts texts = EncodeParams(Params());
  std::erase_if(texts, [](const auto& text) {
    return text.first == "structure.enabled" || text.first == "search.min_confidence";
  });
  EXPECT_FALSE(DecodeParams(texts, 2).ok());
  Params expected;
  expected.structure.enabled = false;
  const auto decoded = DecodeParams(texts, 1);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, expected);
}

TEST(Posts, ComeBackFromTheirBytes) {
  std::vector<Post> posts = {{0, 0, 1}, {-6000, 6000, 0}, {1, -1, 0x7fffffff}, {32767, -32768, 6}};
  Bytes bytes;
  EncodePosts(posts, schema::kVersion, bytes);
  EXPECT_EQ(bytes.size(), 32U);
  std::vector<Post> decoded;
  ASSERT_TRUE(DecodePosts(bytes, schema::kVersion, decoded));
  EXPECT_EQ(decoded, posts);
  EncodePosts(posts, 7, bytes);
  EXPECT_EQ(bytes.size(), 16U);
  ASSERT_TRUE(DecodePosts(bytes, 7, decoded));
  for (Post& post : posts) post.heights = 0;
  EXPECT_EQ(decoded, posts);
  EncodePosts({}, schema::kVersion, bytes);
  ASSERT_TRUE(DecodePosts(bytes, schema::kVersion, decoded));
  EXPECT_TRUE(decoded.empty());
}

TEST(Posts, AreRefusedInPartsAndInMasses) {
  std::vector<Post> decoded;
  for (const std::size_t size : {1U, 2U, 3U, 5U, 4U * 8192U + 4U}) {
    EXPECT_FALSE(DecodePosts(Bytes(size), 7, decoded)) << size;
    EXPECT_FALSE(DecodePosts(Bytes(2 * size), schema::kVersion, decoded)) << 2 * size;
  }
  EXPECT_TRUE(DecodePosts(Bytes(std::size_t{4} * 8192), 7, decoded));
  EXPECT_TRUE(DecodePosts(Bytes(std::size_t{8} * 8192), schema::kVersion, decoded));
}

TEST(Cells, ComeBackFromTheirBytes) {
  std::mt19937 random(3);
  for (const std::size_t size : {1U, 7U, 8U, 9U, 64U, 1200U}) {
    for (const unsigned share : {0U, 10U, 50U, 100U}) {
      std::vector<std::uint16_t> cells(size);
      for (std::uint16_t& cell : cells) {
        if (random() % 100 < share) cell = 1 + random() % Context::kMaxHeight_cm;
      }
      Bytes bytes;
      EncodeCells(cells, bytes);
      std::vector<std::uint16_t> decoded(size, 77);
      ASSERT_TRUE(DecodeCells(bytes, decoded)) << size;
      EXPECT_EQ(decoded, cells);
    }
  }
}

TEST(Cells, HaveTheDocumentedBytes) {
  Bytes bytes;
  EncodeCells(std::vector<std::uint16_t>{0, 0x0102, 0, 0, 0, 0, 0, 0, 0, 5}, bytes);
  const std::uint8_t expected[] = {0x02, 0x02, 0x02, 0x01, 0x05, 0x00};
  EXPECT_TRUE(std::ranges::equal(bytes, std::as_bytes(std::span(expected))));
}

TEST(Cells, AreRefusedInOtherBytes) {
  const auto decodes = [](std::vector<std::uint8_t> bytes) {
    std::vector<std::uint16_t> cells(10);
    return DecodeCells(std::as_bytes(std::span(bytes)), cells);
  };
  EXPECT_TRUE(decodes({0x02, 0x00, 0x01, 0x00}));
  EXPECT_FALSE(decodes({}));
  EXPECT_FALSE(decodes({0x00}));
  EXPECT_FALSE(decodes({0x02, 0x00, 0x01})) << "half a cell";
  EXPECT_FALSE(decodes({0x02, 0x00})) << "a cell too few";
  EXPECT_FALSE(decodes({0x02, 0x00, 0x01, 0x00, 0x01, 0x00})) << "a cell too many";
  EXPECT_FALSE(decodes({0x00, 0x04, 0x01, 0x00})) << "a cell beyond the last";
  EXPECT_FALSE(decodes({0x02, 0x00, 0x00, 0x00})) << "an empty cell in the mask";
  EXPECT_FALSE(decodes({0x02, 0x00, 0x00, 0x20})) << "higher than kMaxHeight_cm";
}

TEST(Keys, AreRefusedOfAnotherLengthOrOutOfRange) {
  const std::vector<std::int32_t> key = {0, 7, 100};
  Bytes bytes;
  EncodeKey(key, bytes);
  std::vector<std::int32_t> decoded(3);
  EXPECT_TRUE(DecodeKey(bytes, 100, decoded));
  EXPECT_EQ(decoded, key);
  EXPECT_FALSE(DecodeKey(bytes, 99, decoded));
  EXPECT_FALSE(DecodeKey(std::span(bytes).first(11), 100, decoded));
  EncodeKey(std::vector<std::int32_t>{0, -1, 0}, bytes);
  EXPECT_FALSE(DecodeKey(bytes, 100, decoded));
}

TEST(Poses, ComeBackWithTheSameBits) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  pose.translation() = Eigen::Vector3d(-0.0, 1e-310, 4.4e6);
  EXPECT_EQ(EncodePose(DecodePose(EncodePose(pose))), EncodePose(pose));
  EXPECT_TRUE(CheckPose(pose).ok());
}

TEST(Names, MayHaveAnyLanguageButNoControlCharacters) {
  for (const std::string name : {"a", "2013-01-10", "Köln", "東京", "🚗", "with space"}) {
    EXPECT_TRUE(CheckName("the session", name).ok()) << name;
  }
  const std::string bad[] = {"",
                             "a\n",
                             std::string("a\0b", 3),
                             "\x7f",
                             "\xff",
                             "\xc3",
                             "\xc0\x80",
                             "\xed\xa0\x80",
                             "\xf4\x90\x80\x80",
                             "\xe2\x82",
                             std::string(256, 'x')};
  for (const std::string& name : bad) {
    EXPECT_EQ(CheckName("the session", name).code(), absl::StatusCode::kInvalidArgument) << name;
  }
}

}  // namespace
}  // namespace scanloc::mapdb

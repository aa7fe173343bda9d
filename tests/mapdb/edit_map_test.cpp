#include "scanloc/mapdb/edit_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/merge_maps.hpp"
#include "support/map_equality.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::BuildSmallMap;
using testing::ElementsAre;
using testing::HasSubstr;

Region Box(double x0, double y0, double x1, double y1) {
  return {.polygon = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
}

/// Two sessions of 5 and 3 places on a line, 2 m and 1 s apart, the second a storey above.
std::vector<EditedPlace> TwoSessions() {
  std::vector<EditedPlace> places;
  for (std::size_t i = 0; i < 8; ++i) {
    EditedPlace place{.place = i, .session = i < 5 ? "a" : "b"};
    place.stamp_ns = static_cast<std::int64_t>(i) * 1'000'000'000;
    place.T_map_place.translation() =
        Eigen::Vector3d(2.0 * static_cast<double>(i % 5), 0.0, i < 5 ? 0.0 : 3.0);
    places.push_back(place);
  }
  return places;
}

/// Numbers of the places that edits leave.
std::vector<std::size_t> Left(const std::vector<Edit>& edits) {
  const absl::StatusOr<EditPlan> plan = PlanEdits(TwoSessions(), edits);
  EXPECT_TRUE(plan.ok()) << plan.status();
  std::vector<std::size_t> left;
  if (!plan.ok()) return left;
  for (const EditedPlace& place : plan->places) left.push_back(place.place);
  return left;
}

TEST(PlanEdits, DropsAndKeepsSessions) {
  EXPECT_THAT(Left({DropSession{"a"}}), ElementsAre(5, 6, 7));
  EXPECT_THAT(Left({KeepSession{"a"}}), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_EQ(Left({KeepSession{"a"}, KeepSession{"b"}}).size(), 8U);
}

TEST(PlanEdits, CropsAndCutsByPlaneTimeAndFloor) {
  EXPECT_THAT(Left({Crop{Box(1, -1, 5, 1)}}), ElementsAre(1, 2, 6, 7));
  EXPECT_THAT(Left({Cut{Box(1, -1, 5, 1)}}), ElementsAre(0, 3, 4, 5));
  EXPECT_THAT(Left({Crop{{.heights_m = std::pair{2.0, 4.0}}}}), ElementsAre(5, 6, 7));
  const std::pair<std::int64_t, std::int64_t> seconds_2_to_4(2'000'000'000, 4'000'000'000);
  EXPECT_THAT(Left({Cut{{.stamps_ns = seconds_2_to_4}}}), ElementsAre(0, 1, 5, 6, 7));
  // A corner cut off: an L is no box.
  EXPECT_THAT(Left({Crop{{.polygon = {{-1, -1}, {9, -1}, {9, 1}, {3, 1}, {3, -0.5}, {-1, -0.5}}}}}),
              ElementsAre(2, 3, 4, 7));
}

TEST(PlanEdits, ThinsSoThatTheNewestStay) {
  EXPECT_THAT(Left({Thin{3.0}}), ElementsAre(0, 2, 4, 5, 7));
  // In space: the storey above counts, too.
  EXPECT_THAT(Left({Thin{3.5}}), ElementsAre(1, 4, 5, 7));
}

TEST(PlanEdits, GoesInTheOrderGiven) {
  const Pose aside = Pose(Eigen::Translation3d(100.0, 0.0, 0.0));
  EXPECT_THAT(Left({Transform{aside}, Crop{Box(101, -1, 105, 1)}}), ElementsAre(1, 2, 6, 7));
  const auto plan =
      PlanEdits(TwoSessions(), {RenameSession{"a", "c"}, DropSession{"b"}, MergeSessions{"all"}});
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_THAT(plan->num_left, ElementsAre(8, 5, 5));
  EXPECT_EQ(plan->places.front().session, "all");
}

TEST(PlanEdits, RefusesWhatMakesNoSense) {
  const auto refused = [](const std::vector<Edit>& edits, absl::StatusCode code,
                          const std::string& text) {
    const absl::Status status = PlanEdits(TwoSessions(), edits).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(text));
  };
  refused({DropSession{"z"}}, absl::StatusCode::kNotFound, "there are: a, b");
  refused({Thin{2.0}, KeepSession{"z"}}, absl::StatusCode::kNotFound, "edit 2 of 2");
  refused({RenameSession{"a", "b"}}, absl::StatusCode::kAlreadyExists, "'b'");
  refused({RenameSession{"a", ""}}, absl::StatusCode::kInvalidArgument, "name");
  refused({Crop{Box(50, 50, 60, 60)}}, absl::StatusCode::kInvalidArgument, "no place");
  refused({Crop{}}, absl::StatusCode::kInvalidArgument, "without bounds");
  refused({Cut{{.polygon = {{0, 0}, {1, 1}}}}}, absl::StatusCode::kInvalidArgument, "3 corners");
  refused({Thin{-1.0}}, absl::StatusCode::kInvalidArgument, "spacing");
  refused({Transform{Pose(Eigen::Translation3d(1e12, 0, 0))}}, absl::StatusCode::kInvalidArgument,
          "");
}

class EditMapTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(BuildSmallMap(in_, 6, "one", 1).ok());
    const auto appended = BuildMap(test::SmallOptions(in_, BuildMode::kAppend),
                                   test::SmallPlan("two", 4), test::SmallLoader(50));
    ASSERT_TRUE(appended.ok()) << appended.status();
  }
  static std::string Bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  test::TempDir dir_;
  const std::string in_ = dir_.File("in.scanloc");
  const std::string out_ = dir_.File("out.scanloc");
  const HistoryEntry made_by_ = {"2026-01-02T03:04:05Z", "edit --something\tnasty\n", {}};
};

TEST_F(EditMapTest, GivesTheMapThatBuildingTheRestGives) {
  const std::string before = Bytes(in_);
  const auto summary = EditMap(in_, out_, {DropSession{"one"}}, made_by_);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(Bytes(in_), before) << "the input was changed";
  const std::string rest = dir_.File("rest.scanloc");
  ASSERT_TRUE(BuildSmallMap(rest, 4, "two", 50).ok());
  EXPECT_EQ(summary->content_id, ReadInfo(rest)->content_id);
  EXPECT_TRUE(test::SameMap(*LoadMap(out_), *LoadMap(rest)));
  EXPECT_TRUE(FindProblems(out_)->empty());
}

TEST_F(EditMapTest, TellsOfWhatItWasMade) {
  const auto first = EditMap(in_, out_, {RenameSession{"one", "1"}}, made_by_);
  ASSERT_TRUE(first.ok()) << first.status();
  const std::string again = dir_.File("again.scanloc");
  ASSERT_TRUE(EditMap(out_, again, {Thin{1.0}}, {"later", "edit --thin 1", {}}).ok());
  const auto info = ReadInfo(again);
  ASSERT_TRUE(info.ok()) << info.status();
  ASSERT_EQ(info->history.size(), 2U);
  EXPECT_EQ(info->history[0].when, made_by_.when);
  EXPECT_THAT(info->history[0].parents, ElementsAre(ReadInfo(in_)->content_id));
  EXPECT_THAT(info->history[0].command, HasSubstr("--something"));
  EXPECT_THAT(info->history[1].parents, ElementsAre(first->content_id));
  EXPECT_TRUE(FindProblems(again)->empty());
  const std::string merged = dir_.File("merged.scanloc");
  ASSERT_TRUE(MergeMaps(merged, {in_, again}, true, {"then", "merge", {}}).ok());
  EXPECT_EQ(ReadInfo(merged)->history.size(), 3U);
  EXPECT_EQ(ReadInfo(merged)->history.back().parents.size(), 2U);
}

TEST_F(EditMapTest, MovesEveryPlaceAndMakesOneSession) {
  Pose T_new_old = Pose::Identity();
  T_new_old.linear() = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T_new_old.translation() << 4.5e5, 5.4e6, 100.0;
  ASSERT_TRUE(EditMap(in_, out_, {Transform{T_new_old}, MergeSessions{"all"}}, made_by_).ok());
  const auto before = ReadPlaces(in_);
  const auto after = ReadPlaces(out_);
  ASSERT_TRUE(before.ok() && after.ok());
  ASSERT_EQ(after->size(), before->size());
  for (std::size_t i = 0; i < after->size(); ++i) {
    const Pose expected = T_new_old * (*before)[i].place.T_map_place;
    EXPECT_TRUE((*after)[i].place.T_map_place.isApprox(expected, 1e-12));
    EXPECT_EQ((*after)[i].place.session, 0);
  }
  EXPECT_EQ(ReadInfo(out_)->sessions.front().name, "all");
}

TEST_F(EditMapTest, LeavesNothingBehindWhereItFails) {
  std::ofstream(out_) << "precious";
  EXPECT_TRUE(absl::IsAlreadyExists(EditMap(in_, out_, {Thin{1.0}}, made_by_).status()));
  EXPECT_EQ(Bytes(out_), "precious");
  std::filesystem::remove(out_);
  EXPECT_FALSE(EditMap(in_, out_, {DropSession{"none"}}, made_by_).ok());
  EXPECT_FALSE(EditMap(dir_.File("none"), out_, {Thin{1.0}}, made_by_).ok());
  EXPECT_FALSE(EditMap(in_, dir_.File("no/folder"), {Thin{1.0}}, made_by_).ok());
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(dir_.File(""))) {
    files.insert(entry.path().filename());
  }
  EXPECT_THAT(files, ElementsAre("in.scanloc"));
}

TEST_F(EditMapTest, ReplacesSomePlacesByThoseOfAnotherMap) {
  const std::string fresh = dir_.File("fresh.scanloc");
  ASSERT_TRUE(BuildSmallMap(fresh, 3, "two", 90).ok());
  std::vector<bool> replaced(10, false);
  replaced[0] = replaced[7] = true;
  ASSERT_TRUE(ReplacePlaces(in_, replaced, fresh, out_, made_by_).ok());
  const auto info = ReadInfo(out_);
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->num_places, 11);
  ASSERT_EQ(info->sessions.size(), 3U);
  EXPECT_EQ(info->sessions[2].name, "two-2");
  EXPECT_TRUE(FindProblems(out_)->empty());
  EXPECT_FALSE(ReplacePlaces(in_, {true}, fresh, dir_.File("x"), made_by_).ok());
}

TEST(DecodeHistory, RefusesTextThatIsNone) {
  EXPECT_FALSE(DecodeHistory("when only\n").ok());
  EXPECT_FALSE(DecodeHistory("a\tb\tc\td\n").ok());
  EXPECT_TRUE(DecodeHistory("")->empty());
}

}  // namespace
}  // namespace scanloc::mapdb

// A map whose contexts and structures are read when they are asked for.
#include "scanloc/core/map/payload.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "scanloc/core/structural/calibrate.hpp"
#include "scanloc/core/track/tracker.hpp"
#include "support/post_world.hpp"
#include "support/same_answer.hpp"

namespace scanloc {
namespace {

using test::Offset;
using test::PostWorld;

/// Reads from a map in memory, and fails when it is told to.
class FakeReader : public PayloadReader {
 public:
  explicit FakeReader(std::shared_ptr<const Map> map) : map_(std::move(map)) {}

  absl::Status Read(std::span<const PayloadId> ids, const SearchControl& control,
                    std::vector<std::shared_ptr<const Payload>>& payloads) const override {
    payloads.assign(ids.size(), nullptr);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (num_reads_left >= 0 && num_reads_left-- == 0) return absl::DataLossError("it is damaged");
      if (control.IsUnwanted()) return absl::CancelledError("unwanted");
      if (control.IsOver()) return absl::OkStatus();
      payloads[i] = std::make_shared<const Payload>(PayloadOf(ids[i]));
    }
    return absl::OkStatus();
  }
  absl::Status Scrub(const std::function<bool(std::size_t)>& /*go_on*/) const override {
    return absl::UnimplementedError("not asked for");
  }

  mutable int num_reads_left = -1;  ///< until the one that fails; negative: none does

 private:
  [[nodiscard]] Payload PayloadOf(const PayloadId& id) const {
    const auto place = static_cast<std::size_t>(id.place);
    if (id.part == PayloadId::Part::kStructure) return {{}, {}, map_->structures[place]};
    const bool is_polar = id.part == PayloadId::Part::kPolar;
    const ContextTable& table = is_polar ? map_->polar : map_->cart;
    const std::size_t num_each = table.size() / map_->places.size();
    const ContextView view = table.context(place * num_each + id.variant);
    return {{view.cells_cm.begin(), view.cells_cm.end()},
            {view.aligning_cm.begin(), view.aligning_cm.end()},
            {}};
  }

  std::shared_ptr<const Map> map_;
};

ContextTable KeysOf(const ContextTable& table) {
  ContextTable keys(table.num_rows(), table.num_cols());
  for (std::size_t i = 0; i < table.size(); ++i) {
    keys.AppendKey(table.entry(i), table.retrieval_key_cm(i));
  }
  return keys;
}

/// The map of a PostWorld without contexts and structures, and what reads them.
struct ReadWorld {
  explicit ReadWorld(const PostWorld& world)
      : reader(std::make_shared<FakeReader>(
            std::shared_ptr<const Map>(world.localizer, &world.localizer->map()))) {
    const Map& whole = world.localizer->map();
    map = std::make_shared<Map>(whole);
    map->polar = KeysOf(whole.polar);
    map->cart = KeysOf(whole.cart);
    map->structures.clear();
    map->payload = reader;
    localizer = *Localizer::Create(map);
  }

  std::shared_ptr<FakeReader> reader;
  std::shared_ptr<Map> map;
  std::shared_ptr<const Localizer> localizer;
};

const PostWorld& World() {
  static const PostWorld world({1, 2, 3, 4, 2, 6, 7, 8});
  return world;
}

ScanDescriptor Seen(std::int32_t place) { return World().Seen(place, Offset(0.4, -0.3, 0.0, 0.7)); }

TEST(PayloadOnDemand, GivesTheAnswersOfAMapInMemory) {
  const ReadWorld read(World());
  for (const char* method : {"auto", "a-pc", "a-cc", "pc", "cc", "a-pc-brute", "a-cc-naive"}) {
    Query query{.method = *ParseMethod(method), .max_answers = 3};
    for (const std::int32_t place : {0, 2, 4}) {
      const ScanDescriptor scan = Seen(place);
      const auto answer = read.localizer->Localize(scan, query);
      ASSERT_TRUE(answer.ok()) << answer.status();
      test::ExpectSameAnswer(*answer, World().Ask(scan, query));
    }
  }
}

TEST(PayloadOnDemand, TracksAndCalibratesAsInMemory) {
  const ReadWorld read(World());
  auto in_memory = *Tracker::Create(World().localizer);
  auto from_file = *Tracker::Create(read.localizer);
  for (const std::int32_t place : {2, 3}) {
    const auto expected = in_memory.Update(Seen(place));
    const auto told = from_file.Update(Seen(place));
    ASSERT_TRUE(told.ok()) << told.status();
    test::ExpectSameAnswer(told->answer, expected->answer);
  }
  const auto whole = std::shared_ptr<const Map>(World().localizer, &World().localizer->map());
  const Calibrator expected(whole);
  const Calibrator calibrator(read.map);
  for (std::size_t i = 0; i < calibrator.num_trials(); ++i) {
    EXPECT_EQ(calibrator.Run(i)->confidence, expected.Run(i)->confidence);
  }
}

TEST(PayloadOnDemand, TellsWhateverReadFailed) {
  const ReadWorld read(World());
  const ScanDescriptor scan = Seen(1);
  for (const char* method : {"auto", "a-pc", "a-cc"}) {
    const Query query{.method = *ParseMethod(method), .num_candidates = 5};
    int num_failed = 0;
    for (int i = 0; i < 1000; ++i) {
      read.reader->num_reads_left = i;
      const auto answer = read.localizer->Localize(scan, query);
      if (answer.ok()) break;
      EXPECT_EQ(answer.status().code(), absl::StatusCode::kDataLoss) << answer.status();
      ++num_failed;
    }
    EXPECT_GE(num_failed, 5);
    EXPECT_LT(num_failed, 1000);
  }
  read.reader->num_reads_left = 0;
  EXPECT_EQ(Tracker::Create(read.localizer)->Update(scan).status().code(),
            absl::StatusCode::kDataLoss);
  read.reader->num_reads_left = 0;
  EXPECT_EQ(Calibrator(read.map).Run(0).status().code(), absl::StatusCode::kDataLoss);
}

TEST(PayloadOnDemand, EndsWhenNobodyWaits) {
  const ReadWorld read(World());
  int num_asked = 0;
  const SearchControl control{.is_unwanted = [&] { return ++num_asked > 3; }};
  EXPECT_EQ(read.localizer->Localize(Seen(1), {}, control).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(PayloadOnDemand, ReadsNoFurtherCandidateOnceTimeIsUp) {
  const ReadWorld read(World());
  const SearchControl late{.now_ns = [] { return std::int64_t{10}; }, .deadline_ns = 5};
  const auto answer = read.localizer->Localize(Seen(1), {}, late);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_NE(answer->outcome, Outcome::kLocalized);
}

}  // namespace
}  // namespace scanloc

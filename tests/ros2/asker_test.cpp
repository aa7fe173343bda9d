#include "asker.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace scanloc::ros2 {
namespace {

/// Streams that answer as they are told, in the order of questions; the last goes on.
class ScriptedClient : public client::LocalizationClient {
 public:
  explicit ScriptedClient(std::vector<absl::Status> script) : script_(std::move(script)) {}

  struct Asked {
    int stream = 0;
    bool has_odometry = false;
  };
  mutable std::vector<Asked> asked;

  absl::StatusOr<client::RobotStream> OpenStream(const client::StreamOptions&) const override {
    return client::RobotStream(std::make_unique<Stream>(*this, ++num_streams_));
  }
  absl::StatusOr<std::vector<MapSummary>> ListMaps() const override { return Unused(); }
  absl::StatusOr<MapInfo> GetMapInfo(const std::string&) const override { return Unused(); }
  absl::StatusOr<PlacesPage> ListPlaces(const std::string&, const std::string&) const override {
    return Unused();
  }
  absl::StatusOr<LocalizeReply> LocalizeScan(PointView,
                                             const client::RequestOptions&) const override {
    return Unused();
  }
  absl::StatusOr<LocalizeReply> LocalizeDescriptor(const SignedDescriptor&,
                                                   const client::RequestOptions&) const override {
    return Unused();
  }

 private:
  class Stream : public client::RobotStream::Tracking {
   public:
    Stream(const ScriptedClient& client, int number) : client_(client), number_(number) {}
    absl::StatusOr<TrackedReply> Locate(PointView scan, const std::optional<Pose>& T_last_scan,
                                        const ScanHeader& /*header*/) override {
      if (scan.empty()) throw std::bad_alloc();
      client_.asked.push_back({number_, T_last_scan.has_value()});
      const absl::Status status =
          client_.script_[std::min(client_.asked.size(), client_.script_.size()) - 1];
      if (!status.ok()) return status;
      return TrackedReply{.num_scans = number_};
    }

   private:
    const ScriptedClient& client_;
    const int number_;
  };

  static absl::Status Unused() { return absl::UnimplementedError("not asked for"); }

  const std::vector<absl::Status> script_;
  mutable int num_streams_ = 0;
};

Question OneQuestion(bool begins_anew) {
  return {.scan = {{1, 2, 3}}, .begins_anew = begins_anew, .T_last_scan = Pose::Identity()};
}

TEST(Asker, KeepsOneStreamUntilAQuestionBeginsAnew) {
  const auto client = std::make_shared<ScriptedClient>(std::vector{absl::OkStatus()});
  Asker asker(client, {});
  for (const bool anew : {true, false, true}) ASSERT_TRUE(asker.Ask(OneQuestion(anew)).ok());
  ASSERT_EQ(client->asked.size(), 3U);
  EXPECT_EQ(client->asked[0].stream, 1);
  EXPECT_FALSE(client->asked[0].has_odometry) << "there is no scan before the first";
  EXPECT_EQ(client->asked[1].stream, 1);
  EXPECT_TRUE(client->asked[1].has_odometry);
  EXPECT_EQ(client->asked[2].stream, 2);
}

TEST(Asker, OpensAnotherStreamForAnotherMount) {
  const auto client = std::make_shared<ScriptedClient>(std::vector{absl::OkStatus()});
  Asker asker(client, {});
  ASSERT_TRUE(asker.Ask(OneQuestion(true)).ok());
  Question moved = OneQuestion(false);
  moved.mount.min_range_m = 1.0;
  ASSERT_TRUE(asker.Ask(moved).ok());
  ASSERT_TRUE(asker.Ask(moved).ok());
  EXPECT_EQ(client->asked[1].stream, 2);
  EXPECT_FALSE(client->asked[1].has_odometry);
  EXPECT_EQ(client->asked[2].stream, 2);
}

TEST(Asker, OpensAStreamThatIsOverOnceMore) {
  const auto client = std::make_shared<ScriptedClient>(
      std::vector{absl::OkStatus(), absl::UnavailableError("idle"), absl::OkStatus()});
  Asker asker(client, {});
  ASSERT_TRUE(asker.Ask(OneQuestion(true)).ok());
  const auto reply = asker.Ask(OneQuestion(false));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->num_scans, 2);
  EXPECT_FALSE(client->asked[2].has_odometry);
}

TEST(Asker, TellsAnErrorThatANewStreamHasToo) {
  const auto client = std::make_shared<ScriptedClient>(
      std::vector{absl::OkStatus(), absl::UnavailableError("away")});
  Asker asker(client, {});
  ASSERT_TRUE(asker.Ask(OneQuestion(true)).ok());
  EXPECT_TRUE(absl::IsUnavailable(asker.Ask(OneQuestion(false)).status()));
  EXPECT_EQ(client->asked.size(), 3U);
}

TEST(Asker, AsksNoSecondTimeWhereThatMakesItWorse) {
  for (const absl::Status& error :
       {absl::DeadlineExceededError("late"), absl::ResourceExhaustedError("busy"),
        absl::InvalidArgumentError("no scan")}) {
    const auto client = std::make_shared<ScriptedClient>(std::vector{absl::OkStatus(), error});
    Asker asker(client, {});
    ASSERT_TRUE(asker.Ask(OneQuestion(true)).ok());
    EXPECT_EQ(asker.Ask(OneQuestion(false)).status(), error);
    EXPECT_EQ(client->asked.size(), 2U);
  }
}

TEST(AskerThread, AnswersAndSurvivesAQuestionWithoutMemory) {
  const auto client = std::make_shared<ScriptedClient>(std::vector{absl::OkStatus()});
  std::mutex mutex;
  std::condition_variable changed;
  int num_replies = 0;
  AskerThread thread(Asker(client, {}), [&] {
    const std::lock_guard lock(mutex);
    ++num_replies;
    changed.notify_all();
  });
  const auto ask = [&](Question question) {
    const int before = num_replies;
    thread.Start(std::move(question));
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return num_replies > before; });
    return thread.TakeReply().value();
  };
  EXPECT_FALSE(thread.IsBusy());
  EXPECT_TRUE(absl::IsResourceExhausted(ask({.begins_anew = true}).status()));
  EXPECT_TRUE(ask(OneQuestion(true)).ok());
  EXPECT_FALSE(thread.TakeReply().has_value()) << "a reply is taken once";
}

}  // namespace
}  // namespace scanloc::ros2

#include "admission/idle_calls.hpp"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <vector>

#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

class Guest : public IdleCall {
 public:
  /// Waits until it is put out.
  absl::Status Await() { return put_out_.get_future().get(); }

 private:
  void OnEvicted(const absl::Status& why) override { put_out_.set_value(why); }
  std::promise<absl::Status> put_out_;
};

IdleCalls::Options For(int max_idle, double timeout_s) {
  return {.max_idle = max_idle,
          .timeout = std::chrono::duration<double>(timeout_s),
          .full = "full",
          .expired = "expired"};
}

TEST(IdleCalls, LetsEachGoOnce) {
  IdleCalls room(For(2, 3600.0));
  const auto guest = std::make_shared<Guest>();
  bool has_begun = false;
  ASSERT_TRUE(room.Enter(guest, "a", [&] { has_begun = true; }).ok());
  EXPECT_TRUE(has_begun);
  EXPECT_EQ(room.num_idle(), 1);
  EXPECT_FALSE(room.Leave(*guest, [] { return false; }));
  EXPECT_TRUE(room.Leave(*guest));
  EXPECT_FALSE(room.Leave(*guest));
  EXPECT_EQ(room.num_idle(), 0);
}

TEST(IdleCalls, PutsOutWhoWaitsTooLong) {
  IdleCalls room(For(2, 0.02));
  const auto guest = std::make_shared<Guest>();
  ASSERT_TRUE(room.Enter(guest, "a").ok());
  EXPECT_EQ(guest->Await(), absl::DeadlineExceededError("expired"));
  EXPECT_FALSE(room.Leave(*guest));
}

TEST(IdleCalls, RefusesOneTooMany) {
  IdleCalls room(For(2, 3600.0));
  std::vector<std::shared_ptr<Guest>> guests;
  for (int i = 0; i < 3; ++i) guests.push_back(std::make_shared<Guest>());
  ASSERT_TRUE(room.Enter(guests[0], "a").ok());
  ASSERT_TRUE(room.Enter(guests[1], "b").ok());
  const absl::Status refused = room.Enter(guests[2], "c");
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(proto::RetryAfter(refused).has_value());
  EXPECT_FALSE(room.Leave(*guests[2]));
  ASSERT_TRUE(room.Leave(*guests[0]));
  EXPECT_TRUE(room.Enter(guests[2], "c").ok());
}

TEST(IdleCalls, MakesRoomForAClientThatHasFewer) {
  IdleCalls room(For(3, 3600.0));
  std::vector<std::shared_ptr<Guest>> guests;
  for (int i = 0; i < 5; ++i) guests.push_back(std::make_shared<Guest>());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(room.Enter(guests[i], "many").ok());
  EXPECT_FALSE(room.Enter(guests[4], "many").ok());
  EXPECT_TRUE(room.Enter(guests[3], "few").ok());
  EXPECT_EQ(guests[0]->Await().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_FALSE(room.Enter(guests[4], "few").ok());  // 2 to 1: nobody has to give way
  EXPECT_EQ(room.num_idle(), 3);
}

TEST(IdleCalls, CountsOnlyWhoHasWaitedForSomeTime) {
  IdleCalls::Options options = For(1, 3600.0);
  options.grace = std::chrono::milliseconds(20);
  IdleCalls room(options);
  std::vector<std::shared_ptr<Guest>> guests;
  for (int i = 0; i < 3; ++i) guests.push_back(std::make_shared<Guest>());
  for (const auto& guest : guests) ASSERT_TRUE(room.Enter(guest, "a").ok());
  // The first settles; the others find the room full.
  EXPECT_EQ(guests[1]->Await().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(guests[2]->Await().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(room.Leave(*guests[0]));
}

TEST(IdleCalls, PutsAllOutWhenItDrains) {
  IdleCalls room(For(3, 3600.0));
  const auto guest = std::make_shared<Guest>();
  ASSERT_TRUE(room.Enter(guest, "a").ok());
  room.Drain(std::chrono::milliseconds(10));
  EXPECT_EQ(guest->Await().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace scanloc::server

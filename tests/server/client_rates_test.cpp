#include "admission/client_rates.hpp"

#include <gtest/gtest.h>

#include <string>

#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

using std::chrono::milliseconds;

const ClientRates::Clock::time_point kStart = ClientRates::Clock::now();

/// How many of so many requests at one time are let through.
int NumTaken(ClientRates& rates, const std::string& client, int num_sent, milliseconds after) {
  int num_taken = 0;
  for (int i = 0; i < num_sent; ++i) {
    if (rates.Take(client, kStart + after).ok()) ++num_taken;
  }
  return num_taken;
}

TEST(ClientRates, LetsASecondsWorthThroughAtOnceAndThenTheRate) {
  ClientRates rates(10.0);
  EXPECT_EQ(NumTaken(rates, "a", 50, milliseconds(0)), 10);
  EXPECT_EQ(NumTaken(rates, "a", 50, milliseconds(301)), 3);
  EXPECT_EQ(NumTaken(rates, "a", 50, milliseconds(60'000)), 10);
}

TEST(ClientRates, CountsEachClientForItself) {
  ClientRates rates(2.0);
  EXPECT_EQ(NumTaken(rates, "a", 50, milliseconds(0)), 2);
  EXPECT_EQ(NumTaken(rates, "b", 50, milliseconds(0)), 2);
}

TEST(ClientRates, SaysWhenTheNextMayCome) {
  ClientRates rates(2.0);
  EXPECT_EQ(NumTaken(rates, "a", 2, milliseconds(0)), 2);
  const absl::Status refused = rates.Take("a", kStart + milliseconds(100));
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(proto::RetryAfter(refused).has_value());
  EXPECT_NEAR(*proto::RetryAfter(refused), 0.4, 1e-6);
  EXPECT_TRUE(rates.Take("a", kStart + milliseconds(501)).ok());
}

TEST(ClientRates, LetsSlowRatesHaveOneAtOnce) {
  ClientRates rates(0.1);
  EXPECT_EQ(NumTaken(rates, "a", 5, milliseconds(0)), 1);
  EXPECT_EQ(NumTaken(rates, "a", 5, milliseconds(9'000)), 0);
  EXPECT_EQ(NumTaken(rates, "a", 5, milliseconds(10'001)), 1);
}

TEST(ClientRates, ToleratesAClockThatStandsOrGoesBack) {
  ClientRates rates(1.0);
  EXPECT_EQ(NumTaken(rates, "a", 2, milliseconds(5'000)), 1);
  EXPECT_EQ(NumTaken(rates, "a", 2, milliseconds(0)), 0);
  EXPECT_EQ(NumTaken(rates, "a", 2, milliseconds(6'001)), 1);
}

TEST(ClientRates, BoundsWhatItRemembersOfClients) {
  ClientRates rates(1.0);
  for (int i = 0; i < 150'000; ++i) {
    ASSERT_TRUE(rates.Take("client " + std::to_string(i), kStart + milliseconds(i / 1000)).ok());
  }
  EXPECT_LE(rates.num_clients(), 100'000U);
}

TEST(ClientRates, KnowsNoClientsWithoutARate) {
  ClientRates rates(0.0);
  EXPECT_EQ(NumTaken(rates, "a", 1000, milliseconds(0)), 1000);
  EXPECT_EQ(rates.num_clients(), 0U);
}

}  // namespace
}  // namespace scanloc::server

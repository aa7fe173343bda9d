#include "scanloc/proto/status.hpp"

#include <gtest/gtest.h>

#include <string>

namespace scanloc::proto {
namespace {

TEST(Status, KeepsCodeAndTextBothWays) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status sent(static_cast<absl::StatusCode>(code), "what, which, why");
    const grpc::Status wire = ToGrpc(sent);
    EXPECT_EQ(static_cast<int>(wire.error_code()), code);
    EXPECT_EQ(FromGrpc(wire), sent);
  }
  EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok());
  EXPECT_TRUE(FromGrpc(grpc::Status::OK).ok());
}

TEST(Status, ReadsAnUnheardOfCodeAsUnknown) {
  // The first that is none yet: the enumeration's type cannot hold much greater ones.
  const grpc::Status strange(static_cast<grpc::StatusCode>(17), "from the future");
  EXPECT_EQ(FromGrpc(strange).code(), absl::StatusCode::kUnknown);
}

TEST(Status, CutsEndlessText) {
  const grpc::Status wire = ToGrpc(absl::InternalError(std::string(1'000'000, 'x')));
  EXPECT_LT(wire.error_message().size(), 4096U);
  EXPECT_EQ(wire.error_code(), grpc::StatusCode::INTERNAL);
}

}  // namespace
}  // namespace scanloc::proto

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
    EXPECT_EQ(FromGrpc(wire).code(), sent.code());
    EXPECT_EQ(FromGrpc(wire).message(), sent.message());
    EXPECT_NE(ReasonOf(FromGrpc(wire)), v1::ERROR_REASON_UNSPECIFIED);
  }
  EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok());
  EXPECT_TRUE(FromGrpc(grpc::Status::OK).ok());
}

TEST(Status, CarriesItsReason) {
  const absl::Status sent = WithReason(v1::ERROR_REASON_DRAINING, absl::UnavailableError("going"));
  EXPECT_EQ(ReasonOf(FromGrpc(ToGrpc(sent))), v1::ERROR_REASON_DRAINING);
  EXPECT_EQ(ReasonOf(FromErrorStatus(ToErrorStatus(sent))), v1::ERROR_REASON_DRAINING);
  EXPECT_EQ(ReasonOf(FromGrpc(ToGrpc(absl::UnavailableError("?")))), v1::ERROR_REASON_NOT_READY);
  EXPECT_EQ(ReasonOf(absl::UnavailableError("cannot connect")), v1::ERROR_REASON_UNSPECIFIED);
}

TEST(Status, ReadsAnErrorOfCodeZeroAsAnError) {
  EXPECT_EQ(FromErrorStatus(v1::ErrorStatus()).code(), absl::StatusCode::kUnknown);
}

TEST(Status, ReadsAnUnheardOfCodeAsUnknown) {
  // The first that is none yet: the enumeration's type cannot hold much greater ones.
  const grpc::Status strange(static_cast<grpc::StatusCode>(17), "from the future");
  EXPECT_EQ(FromGrpc(strange).code(), absl::StatusCode::kUnknown);
}

TEST(Status, CarriesWhenToComeBack) {
  for (const double delay_s : {0.0, 0.05, 0.999, 1.0, 17.25}) {
    const absl::Status sent = WithRetryAfter(absl::ResourceExhaustedError("busy"), delay_s);
    const absl::Status got = FromGrpc(ToGrpc(sent));
    EXPECT_EQ(got.code(), absl::StatusCode::kResourceExhausted);
    ASSERT_TRUE(RetryAfter(got).has_value());
    EXPECT_NEAR(*RetryAfter(got), delay_s, 1e-8);
  }
  EXPECT_FALSE(RetryAfter(absl::ResourceExhaustedError("busy")).has_value());
  EXPECT_FALSE(RetryAfter(FromGrpc(ToGrpc(absl::UnavailableError("gone")))).has_value());
}

TEST(Status, SaysItAsOtherLibrariesReadIt) {
  const grpc::Status wire = ToGrpc(WithRetryAfter(absl::ResourceExhaustedError("busy"), 1.5));
  // google.rpc.Status {code: 8, message: "busy", details: [Any {type_url, value}, ...]} of
  // ErrorInfo {"BUSY", "scanloc"} and RetryInfo {1.5 s}
  const auto field = [](char tag, const std::string& value) {
    return std::string(1, tag) + static_cast<char>(value.size()) + value;
  };
  const auto any = [&](const std::string& type, const std::string& value) {
    return field('\x1a',
                 field('\x0a', "type.googleapis.com/google.rpc." + type) + field('\x12', value));
  };
  const std::string duration("\x08\x01\x10\x80\xca\xb5\xee\x01", 8);
  EXPECT_EQ(wire.error_details(),
            "\x08\x08" + field('\x12', "busy") +
                any("ErrorInfo", field('\x0a', "BUSY") + field('\x12', "scanloc")) +
                any("RetryInfo", field('\x0a', duration)));
}

TEST(Status, DropsDetailsThatCannotBeRead) {
  std::string bytes =
      ToGrpc(WithRetryAfter(absl::ResourceExhaustedError("busy"), 1.5)).error_details();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const absl::Status got =
        FromGrpc({grpc::StatusCode::RESOURCE_EXHAUSTED, "busy", bytes.substr(0, length)});
    EXPECT_EQ(got.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(got.message(), "busy");
    EXPECT_FALSE(RetryAfter(got).has_value()) << length;
  }
  const absl::Status negative = WithRetryAfter(absl::ResourceExhaustedError("busy"), -3.0);
  EXPECT_FALSE(RetryAfter(FromGrpc(ToGrpc(negative))).has_value());
  const absl::Status endless = WithRetryAfter(absl::ResourceExhaustedError("busy"), 1e12);
  EXPECT_EQ(RetryAfter(FromGrpc(ToGrpc(endless))), 3600.0);
}

TEST(Status, CutsEndlessText) {
  const grpc::Status wire = ToGrpc(absl::InternalError(std::string(1'000'000, 'x')));
  EXPECT_LT(wire.error_message().size(), 4096U);
  EXPECT_EQ(wire.error_code(), grpc::StatusCode::INTERNAL);
}

}  // namespace
}  // namespace scanloc::proto

#include "http_parts.hpp"

#include <gtest/gtest.h>

namespace scanloc::web {
namespace {

TEST(ParseTarget, TakesPathAndParametersApart) {
  Request request;
  ASSERT_TRUE(ParseTarget("/a%20b/c?x=1&y=a+b%26&z&x=2", &request).ok());
  EXPECT_EQ(request.path, "/a b/c");
  EXPECT_EQ(request.Parameter("x"), "1");
  EXPECT_EQ(request.Parameter("y"), "a b&");
  EXPECT_EQ(request.Parameter("z"), "");
  EXPECT_EQ(request.Parameter("w"), std::nullopt);
}

TEST(ParseTarget, TakesTextOnly) {
  Request request;
  EXPECT_TRUE(ParseTarget("/v1/answers?map=%C3%A9", &request).ok());
  for (const char* bad : {"/v1/answers?map=%ff", "/%c3", "/v1?%80=1", "/%00"}) {
    EXPECT_FALSE(ParseTarget(bad, &request).ok()) << bad;
  }
}

TEST(ParseAddress, TakesHostsAndPortsOnly) {
  EXPECT_EQ(ParseAddress("127.0.0.1:80")->second, 80);
  EXPECT_EQ(ParseAddress("[::1]:0")->first, "::1");
  for (const char* bad : {"", "80", ":80", "host:", "host:65536", "host:-1", "host:x"}) {
    EXPECT_FALSE(ParseAddress(bad).ok()) << bad;
  }
}

TEST(IsLoopback, IsNotFooledByNames) {
  for (const char* own : {"localhost", "127.0.0.1", "127.9.9.9", "::1"})
    EXPECT_TRUE(IsLoopback(own));
  for (const char* other : {"", "0.0.0.0", "127.0.0.1.example", "10.0.0.1", "::"}) {
    EXPECT_FALSE(IsLoopback(other)) << other;
  }
}

TEST(ErrorResponse, EscapesWhatItRepeats) {
  const std::string body = ErrorResponse(400, "INVALID_ARGUMENT", "\x1b[2J\xff").body;
  EXPECT_EQ(body.find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace scanloc::web

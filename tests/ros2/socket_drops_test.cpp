#include "socket_drops.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace scanloc::ros2 {
namespace {

TEST(NumDroppedDatagrams, CountsThoseOfOwnSocketsThatNobodyTookUp) {
  EXPECT_EQ(NumDroppedDatagrams(), 0U);
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in name{.sin_family = AF_INET};
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof name;
  auto* const any = reinterpret_cast<sockaddr*>(&name);
  ASSERT_EQ(bind(fd, any, size), 0);
  ASSERT_EQ(getsockname(fd, any, &size), 0);
  const std::string datagram(32'000, 'x');
  for (int i = 0; i < 1000; ++i) {
    ASSERT_GT(sendto(fd, datagram.data(), datagram.size(), 0, any, size), 0);
  }
  EXPECT_GT(NumDroppedDatagrams(), 0U);
  close(fd);
  EXPECT_EQ(NumDroppedDatagrams(), 0U);
}

}  // namespace
}  // namespace scanloc::ros2

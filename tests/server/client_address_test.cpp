// Who counts as one client where nobody says who he is.
#include <gtest/gtest.h>

#include <string>

#include "rpc/unary_call.hpp"

namespace scanloc::server {
namespace {

TEST(AddressOfPeer, LeavesOutThePortAndGroupsIpv6ByNetwork) {
  struct Case {
    const char* peer;
    const char* address;
  };
  for (const auto& [peer, address] : {
           Case{"ipv4:10.0.0.7:4242", "ipv4:10.0.0.7"},
           Case{"ipv6:%5B2001:db8:1:2::7%5D:4242", "ipv6:2001:db8:1:2::/64"},
           Case{"ipv6:%5B2001:db8:1:2:ffff:ffff:ffff:ffff%5D:1", "ipv6:2001:db8:1:2::/64"},
           Case{"ipv6:[2001:db8:1:3::7]:4242", "ipv6:2001:db8:1:3::/64"},
           Case{"ipv6:%5Bfe80::1%25eth0%5D:4242", "ipv6:fe80::/64"},
           Case{"ipv6:%5B::ffff:10.0.0.7%5D:4242", "ipv4:10.0.0.7"},
           Case{"ipv6:%5B::1%5D:4242", "ipv6:::/64"},
           Case{"ipv6:%5Bnonsense%5D:4242", "ipv6:%5Bnonsense%5D"},
           Case{"unix:/run/socket", "unix"},
           Case{"", ""},
       }) {
    EXPECT_EQ(AddressOfPeer(peer), address) << peer;
  }
}

}  // namespace
}  // namespace scanloc::server

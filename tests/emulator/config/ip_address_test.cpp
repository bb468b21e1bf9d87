#include "emulator/config/ip_address.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace ip_address_test {

TEST(IpAddress, RequiresBracketsForIPv6) {
  EXPECT_EQ(address_in("192.168.0.2"), "192.168.0.2");
  EXPECT_EQ(address_in("[::1]"), "::1");
  EXPECT_EQ(address_in("localhost"), "127.0.0.1");
  EXPECT_EQ(address_in("LocalHost"), "127.0.0.1");
  for (const char* text : {"", "::1", "[127.0.0.1]", "[]", "[", "[localhost]", "robot", "1.2.3",
                           "1.2.3.256", "1.2..4", "01.2.3.4", "1.2.3.4.5", " 1.2.3.4", "1.2.3.4%lo",
                           "[1:2]", "[:::]", "[::12345]", "[::1", "::1]"}) {
    EXPECT_EQ(address_in(text), std::nullopt) << text;
  }
}

TEST(IpAddress, IsNormalized) {
  EXPECT_EQ(address_in("[0:0:0:0:0:0:0:1]"), "::1");
  EXPECT_EQ(address_in("[FE80::00A1%eth0]"), "fe80::a1%eth0");
}

TEST(IpAddress, ClassifiesAddresses) {
  for (const char* group : {"224.0.0.0", "239.255.255.255", "ff02::1", "FF02::1", "fF02::1"}) {
    EXPECT_TRUE(is_multicast(group)) << group;
  }
  // ff::1 means 00ff::1.
  for (const char* other : {"223.255.255.255", "240.0.0.0", "ff::1", "fe80::1", "ffrog"}) {
    EXPECT_FALSE(is_multicast(other)) << other;
  }
  EXPECT_TRUE(is_loopback("127.9.9.9"));
  EXPECT_TRUE(is_loopback("::1"));
  EXPECT_FALSE(is_loopback("128.0.0.1"));
  EXPECT_FALSE(is_loopback("::2"));
}

}  // namespace ip_address_test
}  // namespace lk::emulator

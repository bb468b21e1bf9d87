#include "emulator/io/transports/netlink.hpp"

#include <gtest/gtest.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>

namespace lk::emulator {
namespace netlink_test {

using Clock = std::chrono::steady_clock;

/// A monitor reads `socket` only at once and then every second while the loop runs a thousand
/// times.
void expect_no_spin(int socket) {
  boost::asio::io_context loop;
  int looks = 0;
  const auto begin = Clock::now();
  const LinkMonitor monitor(
      loop, [&looks] { ++looks; }, socket);
  for (int n = 0; n < 1000; ++n) loop.poll();
  EXPECT_LE(looks, 1 + (Clock::now() - begin) / std::chrono::seconds(1));
  // It keeps reading every now and then.
  const int before = looks;
  while (looks == before && Clock::now() - begin < std::chrono::seconds(60)) {
    loop.run_one_for(std::chrono::seconds(1));
  }
  EXPECT_GT(looks, before);
}

TEST(LinkMonitor, StopsReadingAClosedOrFailingSocket) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
  ::close(ends[1]);
  expect_no_spin(ends[0]);
  ASSERT_EQ(::pipe(ends.data()), 0);
  ::close(ends[1]);
  expect_no_spin(ends[0]);  // always ready, with ENOTSOCK each time
}

TEST(LinkMonitor, CallsBackOnMessages) {
  std::array<int, 2> pair{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, pair.data()), 0);
  boost::asio::io_context loop;
  int looks = 0;
  const LinkMonitor monitor(
      loop, [&looks] { ++looks; }, pair[0]);
  for (int round = 1; round <= 3; ++round) {
    const int before = looks;
    ASSERT_EQ(::send(pair[1], "x", 1, 0), 1);
    ASSERT_EQ(::send(pair[1], "y", 1, 0), 1);
    loop.poll();
    EXPECT_GT(looks, before) << round;
  }
  ::close(pair[1]);
}

TEST(LinkState, MatchesTheKernel) {
  const LinkState loopback = link_state("lo");
  EXPECT_EQ(loopback.index, static_cast<int>(::if_nametoindex("lo")));
  EXPECT_EQ(loopback.name, "lo");
  EXPECT_FALSE(loopback.is_can);
  EXPECT_EQ(loopback.kind, "");
  EXPECT_EQ(loopback.peer, 0);
  EXPECT_FALSE(loopback.is_virtual());
  EXPECT_EQ(link_state("nosuchbus").index, 0);
}

}  // namespace netlink_test
}  // namespace lk::emulator

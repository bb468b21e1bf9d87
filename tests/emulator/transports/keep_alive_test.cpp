#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "emulator/files/durable_file.hpp"
#include "emulator/io/transports/client_set.hpp"

namespace lk::emulator {
namespace keep_alive_test {

int option_of(const Descriptor& socket, int level, int name) {
  int value = -1;
  socklen_t size = sizeof value;
  EXPECT_EQ(::getsockopt(socket.get(), level, name, &value, &size), 0);
  return value;
}

/// Idle or with an unacknowledged reply: both take a minute.
TEST(KeepAlive, ClosesOneMinuteAfterPeerLoss) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const name = reinterpret_cast<sockaddr*>(&address);
  const Descriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(::bind(listener.get(), name, size), 0);
  ASSERT_EQ(::listen(listener.get(), 1), 0);
  ASSERT_EQ(::getsockname(listener.get(), name, &size), 0);
  keep_connections_alive(listener.get());
  const Descriptor peer(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(::connect(peer.get(), name, size), 0);
  const Descriptor accepted(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC));
  ASSERT_TRUE(accepted);

  EXPECT_EQ(option_of(accepted, SOL_SOCKET, SO_KEEPALIVE), 1);
  const int idle_s = option_of(accepted, IPPROTO_TCP, TCP_KEEPIDLE);
  const int interval_s = option_of(accepted, IPPROTO_TCP, TCP_KEEPINTVL);
  EXPECT_EQ(idle_s + interval_s * option_of(accepted, IPPROTO_TCP, TCP_KEEPCNT), 60);
  EXPECT_EQ(option_of(accepted, IPPROTO_TCP, TCP_USER_TIMEOUT), 60'000) << "milliseconds";
}

}  // namespace keep_alive_test
}  // namespace lk::emulator

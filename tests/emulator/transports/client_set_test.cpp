// Clients as their port uses them. SOCK_SEQPACKET shows the data of each system call.

#include "emulator/io/transports/client_set.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "emulator/io/transports/slcan.hpp"

namespace lk::emulator {
namespace {

using protocol::Frame;

constexpr std::string_view kQuery = "t14189A00000000000000\r";
constexpr std::string_view kReply = "t14189A1900F000000000\r";

class ClientConnection : public ::testing::Test {
 protected:
  ClientConnection() {
    int ends[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    host_ = Descriptor(ends[0]);
    clients_.add(Descriptor(ends[1]), "a host", std::make_unique<Slcan>(1'000'000));
    say("O\r");
    collect();
    clients_.flush();
    EXPECT_EQ(hear(), "\r");
  }

  void say(std::string_view text) const {
    EXPECT_EQ(::send(host_.get(), text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  }
  /// Returns the data of one system call, if any.
  std::optional<std::string> hear() const {
    std::string text(std::size_t{256} * 1024, '\0');
    const ssize_t size = ::recv(host_.get(), text.data(), text.size(), 0);
    if (size < 0) return std::nullopt;
    text.resize(static_cast<std::size_t>(size));
    return text;
  }
  std::size_t collect() {
    std::vector<ReceivedFrame> frames;
    clients_.collect(frames);
    return frames.size();
  }
  void reply(std::size_t times) {
    const Frame frame = *parse_slcan_frame(kReply.substr(0, kReply.size() - 1));
    for (std::size_t n = 0; n < times; ++n) clients_.queue_frames({&frame, 1}, 0);
  }

  ClientSet clients_{"slcan-tcp:29536"};
  Descriptor host_;
};

TEST_F(ClientConnection, GetsQueuedRepliesInOneWrite) {
  say(std::string(kQuery) + std::string(kQuery) + std::string(kQuery));
  ASSERT_EQ(collect(), 3U);
  reply(3);
  EXPECT_EQ(hear(), std::nullopt) << "others may follow";
  clients_.flush();
  EXPECT_EQ(hear(), "z\rz\rz\r" + std::string(kReply) + std::string(kReply) + std::string(kReply));
  EXPECT_EQ(hear(), std::nullopt);
}

/// As with `printf … | socat - TCP:…` and `nc -N`.
TEST_F(ClientConnection, GetsItsReplyAfterShutdownOfWriting) {
  say(kQuery);
  ASSERT_EQ(collect(), 1U);
  ::shutdown(host_.get(), SHUT_WR);
  collect();
  collect();
  EXPECT_EQ(clients_.size(), 1U);
  reply(1);
  clients_.flush();
  EXPECT_EQ(hear(), "z\r" + std::string(kReply));
  EXPECT_EQ(hear(), std::nullopt);
  // The host also waits for the end of the stream.
  std::vector<ReceivedFrame> frames;
  for (int n = 0; n < 3 && clients_.size() > 0; ++n) {
    clients_.collect(frames, 2 * ClientSet::kLastReply);
  }
  EXPECT_EQ(clients_.size(), 0U);
  EXPECT_EQ(hear(), "");
}

TEST_F(ClientConnection, IsRemovedAfterDisconnect) {
  host_ = Descriptor();
  collect();
  clients_.drop_finished();
  EXPECT_EQ(clients_.size(), 0U);
}

TEST_F(ClientConnection, IsAwaitedOnRequest) {
  std::vector<ReceivedFrame> frames;
  std::thread host([this] { say(kQuery); });
  clients_.collect(frames, std::chrono::minutes(1));
  host.join();
  EXPECT_EQ(frames.size(), 1U);
}

TEST_F(ClientConnection, LosesNoRepliesWhileItReads) {
  const std::size_t times = 2 * ClientSet::kMaxUnsent / kReply.size();
  reply(times);
  clients_.flush();
  std::string heard;
  while (const auto more = hear()) heard += *more;
  EXPECT_EQ(heard.size(), times * kReply.size());
  EXPECT_EQ(clients_.stats().lost_unread, 0U);
}

TEST_F(ClientConnection, GetsAnswersDespiteLostFrames) {
  const int few_bytes = 4096;
  ASSERT_EQ(::setsockopt(host_.get(), SOL_SOCKET, SO_RCVBUF, &few_bytes, sizeof few_bytes), 0);
  while (clients_.stats().lost_unread < 1000) reply(1000);
  say("F\rV\r");  // more than the space that frames have left
  EXPECT_EQ(collect(), 0U);
  std::string heard;
  while (const auto more = hear()) {
    heard += *more;
    collect();  // space is free again
  }
  EXPECT_TRUE(heard.ends_with("F08\rV1013\r")) << heard.size();
}

TEST(ClientSet, LimitsBytesReadAtOnce) {
  ClientSet clients{"slcan-tcp:29536"};
  std::vector<Descriptor> hosts;
  constexpr std::size_t kHosts = 32;
  std::string lines;  // malformed lines, which the statistics count
  while (lines.size() < 4096) lines += "x\r";
  for (std::size_t n = 0; n < kHosts; ++n) {
    int ends[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    hosts.emplace_back(ends[0]);
    clients.add(Descriptor(ends[1]), "a host", std::make_unique<Slcan>(1'000'000));
    ASSERT_EQ(::send(ends[0], lines.data(), lines.size(), 0), static_cast<ssize_t>(lines.size()));
  }
  std::vector<ReceivedFrame> frames;
  EXPECT_TRUE(clients.collect(frames).more);
  EXPECT_LE(clients.stats().malformed, 2 * lines.size() / 2);
  EXPECT_GE(clients.stats().malformed, kHosts) << "each has its turn";
  while (clients.collect(frames).more) {
  }
  EXPECT_EQ(clients.stats().malformed, kHosts * lines.size() / 2);
}

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

/// All within ten seconds, unless the machine stalls for that long.
TEST(LogLimit, AllowsTwentyMessagesPerPeriod) {
  LogLimit limit;
  int told = 0;
  for (int n = 0; n < 1000; ++n) told += limit.may_log("vcan0") ? 1 : 0;
  EXPECT_EQ(told, 20);
}

}  // namespace
}  // namespace lk::emulator

// Hosts that connect just before a port reads: this program replaces read().

#undef _FORTIFY_SOURCE  // its header also defines read, and Clang accepts no second definition

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/files/durable_file.hpp"
#include "emulator/io/transports/port.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/support/serial.hpp"
#include "tests/support/temp_directory.hpp"

namespace {

std::function<void()> before_next_terminal_read;

}  // namespace

extern "C" ssize_t read(int fd, void* bytes, size_t size) {
  if (before_next_terminal_read && ::isatty(fd) != 0) {
    std::exchange(before_next_terminal_read, nullptr)();
  }
  return ::syscall(SYS_read, fd, bytes, size);
}

namespace lk::emulator {
namespace pty_read_test {

/// A port with a pseudo-terminal, and a host that opens it and writes just before the port reads.
class HostBeforeRead : public testing::Test {
 protected:
  void expect_reply(const BusConfig& bus, std::string_view query,
                    const std::function<void(Port&)>& reply) {
    const auto port = make_port(loop_, bus, Interfaces::kVirtualOnly, [] {});
    Descriptor host;
    before_next_terminal_read = [&] {
      host = Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
      EXPECT_EQ(::write(host.get(), query.data(), query.size()),
                static_cast<ssize_t>(query.size()));
    };
    const auto ignore = [](std::span<const ReceivedFrame>) {};
    port->receive(ignore);
    ASSERT_TRUE(host);
    reply(*port);
    port->receive(ignore);  // the port sees the open event here at the latest
    pollfd readable{.fd = host.get(), .events = POLLIN, .revents = 0};
    EXPECT_EQ(::poll(&readable, 1, 0), 1) << "the reply was discarded";
  }

  test::TempDirectory own_;
  std::string path_ = own_.path("arm");
  boost::asio::io_context loop_;
};

TEST_F(HostBeforeRead, GetsTheReplyOfADriveOnRs485) {
  BusConfig bus;
  bus.bitrate = 0;
  bus.interface = "rs485:" + path_;
  bus.serial.emplace().as_tty = false;
  std::vector<protocol::Frame> frames;
  protocol::append_frames(test::bytes("3E 9A 01 00 D9"), frames);
  expect_reply(bus, "\x3E\x9A\x01", [&](Port& port) { port.send(frames); });
}

TEST_F(HostBeforeRead, GetsTheReplyOfAnSlcanAdapter) {
  BusConfig bus;
  bus.bitrate = 0;
  bus.interface = "slcan-pty:" + path_;
  expect_reply(bus, "V\r", [](Port& port) { port.end_turn(); });
}

}  // namespace pty_read_test
}  // namespace lk::emulator

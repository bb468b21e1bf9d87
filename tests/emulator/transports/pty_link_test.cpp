// Hosts that share a pseudo-terminal or use it one after another.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <string>
#include <string_view>

#include "emulator/files/durable_file.hpp"
#include "emulator/io/transports/terminal.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace pty_link_test {

class Pty : public testing::Test {
 protected:
  Descriptor open() const {
    return Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  }
  /// Opens the terminal as a host, and updates the link.
  Descriptor come() {
    Descriptor host = open();
    link_.handle_host_events();
    return host;
  }
  void reply(std::string_view bytes) {
    ASSERT_EQ(::write(link_.descriptor(), bytes.data(), bytes.size()),
              static_cast<ssize_t>(bytes.size()));
  }
  static std::string read(const Descriptor& host) {
    pollfd readable{.fd = host.get(), .events = POLLIN, .revents = 0};
    ::poll(&readable, 1, 0);  // wait for bytes in transit
    char bytes[16];
    const ssize_t size = ::read(host.get(), bytes, sizeof bytes);
    return {bytes, size > 0 ? static_cast<std::size_t>(size) : 0};
  }

  test::TempDirectory own_;
  std::string path_ = own_.path("arm");
  boost::asio::io_context loop_;
  PtyLink link_{loop_, "rs485:arm", path_, true};
};

TEST_F(Pty, KeepsUnreadBytesWhileOneOfTwoHostsStays) {
  const Descriptor stays = open();
  Descriptor leaves = open();  // inotify merges both opens into one event
  link_.handle_host_events();
  reply("reply");
  leaves = Descriptor();
  link_.handle_host_events();
  EXPECT_EQ(read(stays), "reply");
}

TEST_F(Pty, DiscardsUnreadBytesWhenTwoHostsCloseItAtOnce) {
  Descriptor first = come();
  Descriptor second = come();
  reply("old");
  first = Descriptor();
  second = Descriptor();  // inotify merges both closes into one event
  link_.handle_host_events();
  const Descriptor next = come();
  EXPECT_EQ(read(next), "");
  reply("new");
  EXPECT_EQ(read(next), "new");
}

TEST_F(Pty, DiscardsBytesWrittenWithoutAHost) {
  Descriptor host = come();
  host = Descriptor();
  link_.handle_host_events();
  reply("late");
  host = come();
  EXPECT_EQ(read(host), "");
}

TEST_F(Pty, DiscardsUnreadBytesOnImmediateReopen) {
  Descriptor host = come();
  reply("old");
  host = Descriptor();
  host = open();
  link_.handle_host_events();
  EXPECT_EQ(read(host), "");
}

TEST_F(Pty, KeepsBytesWrittenBeforeClose) {
  Descriptor host = come();
  ASSERT_EQ(::write(host.get(), "query", 5), 5);
  host = Descriptor();
  link_.handle_host_events();
  char bytes[16];
  EXPECT_EQ(::read(link_.descriptor(), bytes, sizeof bytes), 5);
}

TEST_F(Pty, CausesNoEventsAfterAHostHasClosed) {
  Descriptor host = open();
  host = Descriptor();
  int handled = 0;
  while (handled < 10 && loop_.poll_one() > 0) ++handled;
  EXPECT_GT(handled, 0);
  EXPECT_LT(handled, 10) << "the link's own opening and closing must cause no events";
}

}  // namespace pty_link_test
}  // namespace lk::emulator

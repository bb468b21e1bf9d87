#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "emulator/files/durable_file.hpp"
#include "emulator/io/transports/socketcan.hpp"
#include "tests/support/log.hpp"

namespace lk::emulator {
namespace socketcan_port_test {

/// While it exists, no descriptor can be opened.
class NoDescriptors {
 public:
  NoDescriptors() {
    // On its first use of a type, UBSan opens a pipe, so use this type now.
    try {
      throw std::system_error(EMFILE, std::generic_category(), "as later");
    } catch (const std::system_error& problem) {
      EXPECT_STREQ(problem.what(), "as later: Too many open files");
    }
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const Descriptor next(::open("/dev/null", O_RDONLY | O_CLOEXEC));  // the lowest free one
    const rlimit limit{static_cast<rlim_t>(next.get()), before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;
  ~NoDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

TEST(SocketCanPort, DescriptorShortageIsNotAMissingInterface) {
  const test::Log log;
  boost::asio::io_context loop;
  const auto port = [&loop](const char* interface) {
    BusConfig bus;
    bus.interface = interface;
    return make_socketcan_port(loop, bus, Interfaces::kVirtualOnly, [] {});
  };
  port("none")->check_link();
  const auto there = port("lo");
  {
    const NoDescriptors none;
    there->check_link();
    there->check_link();
  }
  EXPECT_EQ(log.text(),
            "none is gone: waiting until it is created again\nlo: cannot open: socket: Too many "
            "open files\n");
}

}  // namespace socketcan_port_test
}  // namespace lk::emulator

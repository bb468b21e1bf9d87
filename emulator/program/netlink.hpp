#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>
#include <string>

namespace lk::emulator {

/// What the kernel says of an interface now.
struct LinkState {
  int index = 0;  // 0: there is none of this name
  bool is_can = false;
  bool up = false;
};
LinkState link_state(const std::string& interface);

/// Makes `interface` as a vcan unless it exists, and brings it up. Throws std::system_error.
void create_vcan(const std::string& interface);

/// Calls back whenever some interface of the machine has come, gone or changed. Messages are only a
/// sign to look again, so that lost ones do no harm.
class LinkMonitor {
 public:
  LinkMonitor(boost::asio::io_context& loop, std::function<void()> on_change);

 private:
  void wait();
  void drain();

  boost::asio::posix::stream_descriptor socket_;
  std::function<void()> on_change_;
};

}  // namespace lk::emulator

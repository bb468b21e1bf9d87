#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <string>

namespace lk::emulator {

/// What the kernel says of an interface now.
struct LinkState {
  int index = 0;  // 0: there is not one of this name
  bool is_can = false;
  bool up = false;
  std::string name;  // as the kernel has it; interfaces may have alternative names
  std::string kind;  // "vcan", "vxcan", "can" …; empty: its driver does not say
  int peer = 0;      // index of the other end of a vxcan pair, if it is in this network namespace

  /// No real drive can be on it.
  bool is_virtual() const { return kind == "vcan" || kind == "vxcan"; }
};
/// Throws std::system_error when the kernel cannot be asked.
LinkState link_state(const std::string& interface);
/// Which interfaces a run may use.
enum class Interfaces : std::uint8_t { kVirtualOnly, kAll };

/// What the interface `index` is called now; empty: it is gone.
std::string link_name(int index);

/// Makes `interface` as a vcan unless it exists, and brings it up. Throws std::system_error.
void create_vcan(const std::string& interface);

/// A socket that can be read when some interface of the machine has come, gone or changed. Throws
/// std::system_error.
int open_link_socket();

/// Calls back whenever some interface may have changed, and every second all the same: messages are
/// only a sign to look again, so that lost ones do no harm, nor does a socket that gives none.
class LinkMonitor {
 public:
  /// Closes `socket` in the end.
  LinkMonitor(boost::asio::io_context& loop, std::function<void()> on_look,
              int socket = open_link_socket());

 private:
  void wait();
  void look_now_and_then();
  /// Returns 0, or errno when the socket will not do.
  int drain();

  boost::asio::posix::stream_descriptor socket_;
  boost::asio::steady_timer now_and_then_;
  std::function<void()> on_look_;
};

}  // namespace lk::emulator

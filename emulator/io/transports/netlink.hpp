#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <string>

namespace lk::emulator {

/// State of an interface as the kernel reports it.
struct LinkState {
  int index = 0;  // 0: no interface has this name
  bool is_can = false;
  bool up = false;
  std::string name;  // the kernel's name; the interface may have alternative names
  std::string kind;  // "vcan", "vxcan", "can" …; empty: not reported by the driver
  int peer = 0;      // index of the other end of a vxcan pair; 0: none in this network namespace

  /// Returns true if no real drive can be on the interface.
  bool is_virtual() const { return kind == "vcan" || kind == "vxcan"; }
};
/// Returns the state of `interface`; index 0 if it does not exist. Throws std::system_error if the
/// kernel does not answer.
LinkState link_state(const std::string& interface);
/// Which interfaces a run may use.
enum class Interfaces : std::uint8_t { kVirtualOnly, kAll };

/// Returns the current name of interface `index`; empty if it is gone.
std::string link_name(int index);

/// Creates `interface` as a vcan unless it exists, and brings it up. Throws std::system_error.
void create_vcan(const std::string& interface);

/// Opens a socket that is readable when an interface is added, removed or changed. Throws
/// std::system_error.
int open_link_socket();

/// Calls `on_change` when an interface may have changed, and every second. The content of the
/// kernel's messages is not used, so lost messages or a broken socket only delay a call.
class LinkMonitor {
 public:
  /// Takes ownership of `socket`.
  LinkMonitor(boost::asio::io_context& loop, std::function<void()> on_change,
              int socket = open_link_socket());

 private:
  void wait();
  void poll();
  /// Discards all messages. Returns 0, or errno if the socket is unusable.
  int drain();

  boost::asio::posix::stream_descriptor socket_;
  boost::asio::steady_timer poll_timer_;
  std::function<void()> on_change_;
};

}  // namespace lk::emulator

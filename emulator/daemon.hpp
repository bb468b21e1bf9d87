#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <memory>
#include <string>
#include <vector>

#include "emulator/bus.hpp"
#include "emulator/netlink.hpp"
#include "emulator/pacer.hpp"
#include "emulator/socketcan_port.hpp"

namespace lk::emulator {

/// The running program: buses on their interfaces, paced by the clock, on one thread and one loop.
class Daemon {
 public:
  /// Throws StartError when an interface cannot be had.
  Daemon(const std::vector<BusConfig>& buses, bool create_buses);

  /// Until SIGINT or SIGTERM; then prints the summary.
  void run();

 private:
  struct Line {
    Bus bus;
    SocketCanPort port;
    std::string ids;  // for people
  };

  /// Takes in what has arrived, brings the bus to `mono`, lets the replies out.
  void serve(Line& line, MonoTime mono);
  void serve_all();
  void follow_links();
  void say_ready_once();
  void arm_timer(MonoTime mono);
  void print_summary() const;

  boost::asio::io_context loop_{1};
  SimClock clock_;
  SlipReporter slip_reporter_;
  std::vector<std::unique_ptr<Line>> lines_;
  std::vector<TimedFrame> replies_;  // kept for its memory
  WakeTimer timer_;
  LinkMonitor links_;
  boost::asio::signal_set signals_;
  MonoTime started_;
  bool ready_ = false;
};

}  // namespace lk::emulator

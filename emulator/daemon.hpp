#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/bus.hpp"
#include "emulator/netlink.hpp"
#include "emulator/pacer.hpp"
#include "emulator/recorder.hpp"
#include "emulator/rom_gate.hpp"
#include "emulator/rom_options.hpp"
#include "emulator/rom_store.hpp"
#include "emulator/rom_writer.hpp"
#include "emulator/socketcan_port.hpp"

namespace lk::emulator {

/// The running program: buses on their interfaces, paced by the clock, on one thread and one loop.
/// Only the disk is another thread's.
class Daemon {
 public:
  /// Throws StartError when an interface, the ROM or a place for the recording cannot be had.
  Daemon(std::vector<BusConfig> buses, bool create_buses, const RomOptions& rom,
         const std::optional<RecordRequest>& record = std::nullopt);

  /// Until SIGINT or SIGTERM; then waits for the disk, not for long, and prints the summary. Does
  /// not return when the disk still has not answered: it ends the process.
  void run();

 private:
  struct Line {
    Bus bus;
    SocketCanPort port;
    RomGate gate;
    std::string ids;  // for people
  };

  /// Takes in what has arrived, brings the bus to `mono`, lets the replies out.
  void serve(std::size_t line, MonoTime mono);
  void serve_all();
  void take_in(std::size_t line, TimedFrame in);
  /// To `until`, and lets out what drives say on the way.
  void bring_to(std::size_t line, SimTime until);
  void keep_rom(std::size_t line);
  RomWriter& rom_writer();
  /// On the loop: the disk has answered; `error` is 0 or errno.
  void settle_rom(std::size_t line, const RomWrite& write, int error);
  void begin_stop();
  void wait_to_end();
  bool rom_is_settled() const;
  bool disk_is_done() const;
  bool replies_have_left() const;
  void follow_links();
  void say_ready_once();
  void arm_timer(MonoTime mono);
  void print_summary() const;

  boost::asio::io_context loop_{1};
  SimClock clock_;
  SlipReporter slip_reporter_;
  std::vector<std::unique_ptr<Line>> lines_;
  std::vector<TimedFrame> replies_;  // these three are kept for their memory
  std::vector<RomWrite> rom_writes_;
  std::vector<protocol::Frame> leaving_;
  WakeTimer timer_;
  LinkMonitor links_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer patience_;  // at the end: with the disk, then with the interfaces
  MonoTime give_up_disk_{};
  MonoTime give_up_{};
  MonoTime started_;
  bool ready_ = false;
  bool stopping_ = false;              // time stands still
  std::optional<RomStore> rom_store_;  // none: ROM ends with the process
  std::optional<Recorder> recorder_;
  std::optional<RomWriter> rom_writer_;  // last: its thread ends before what it reports to
};

}  // namespace lk::emulator

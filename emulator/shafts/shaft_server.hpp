#pragma once

#include <spdlog/common.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/live/world.hpp"
#include "emulator/shafts/shaft_body.hpp"
#include "emulator/shafts/shaft_messages.hpp"
#include "emulator/shafts/shaft_options.hpp"
#include "emulator/transports/socket_listener.hpp"
#include "emulator/transports/tell_limit.hpp"

namespace lk::emulator {

/// Gives the shafts of all drives to a simulator: docs/shafts.md. One at a time; on the loop of the
/// world, which no simulator can stop or make wait. As long as there is none, the drives have the
/// loads of their robot file.
class ShaftServer {
 public:
  /// Throws StartError when it cannot listen there.
  ShaftServer(boost::asio::io_context& loop, World& world, const ShaftOptions& options);
  ShaftServer(const ShaftServer&) = delete;
  ShaftServer& operator=(const ShaftServer&) = delete;
  ~ShaftServer();

  /// The world has started: without a simulator it stands, where it is to.
  void start();
  /// "unix:/tmp/shafts", "tcp:127.0.0.1:29600"
  const std::string& place() const { return place_; }

 private:
  struct Shaft {
    std::size_t bus;
    int id;
    std::string name;
    const ServoConfig* servo;
  };
  /// Who is connected.
  struct Simulator {
    Simulator(boost::asio::io_context& loop, int fd, std::uint32_t joints, unsigned its_number)
        : socket(loop, fd), reader(joints), number(its_number) {}
    boost::asio::posix::stream_descriptor socket;
    ShaftReader reader;
    unsigned number;
    std::optional<ShaftAccept> accepted;
    std::vector<std::size_t> taken;  // of the shafts: those that it takes
    ShaftBody* body = nullptr;       // the world's coupling has it; null: no states have come
    std::uint64_t steps_done = 0;
    std::uint64_t answers = 0;  // what STATES have to be numbered
    bool owes = true;           // STATES
    bool late = false;          // has been, and that was said
    bool unread = false;        // it does not read
    bool is_told = true;        // in the log
  };

  model::MountedShaft now(const Shaft& shaft) const;
  bool is_stiff(const Shaft& shaft) const;
  void listen(const ShaftOptions& options);
  void meet(int fd);
  void hear();
  void hear_all();
  bool is_here(unsigned number) const { return simulator_ && simulator_->number == number; }
  /// False: nothing more of it now.
  bool hear_some();
  void hear_message(ShaftReader::Message message);
  void hear_accept(ShaftAccept accept);
  void hear_states(const ShaftStates& states);
  void begin(const ShaftStates& states);
  /// The drives have done a step; whether they can go on.
  bool end_step();
  void go_on_without_answer();
  void send_torques();
  void step_clock();
  void take_clock();
  void send(const ShaftBytes& bytes);
  /// The simulator is let go; it is told why where it was at fault.
  void part(const std::string& why, bool at_fault);
  void leave();
  /// Logs that the simulator `why`, and lets go of it.
  void release(spdlog::level::level_enum level, const std::string& why);
  /// What the drives are left with.
  void leave_drives();
  bool has_time() const {
    return simulator_ && simulator_->accepted &&
           simulator_->accepted->head.what == LK_SHAFTS_TIME_IS_SIMULATORS;
  }

  boost::asio::io_context& loop_;
  World& world_;
  ShaftsLost lost_;
  std::string place_;
  std::optional<SocketListener> listener_;
  std::vector<Shaft> shafts_;
  std::optional<Simulator> simulator_;
  boost::asio::steady_timer manners_;  // how long one may say nothing at first
  WakeTimer patience_;                 // how long a step of the clock's waits
  MonoTime give_up_{0};
  MonoTime poll_until_{0};
  ClockMode clock_before_;
  bool clock_is_stopped_ = false;  // as a simulator was lost
  bool step_is_due_ = false;       // of a clock that is still being moved
  SimTime step_{std::chrono::milliseconds(1)};
  unsigned simulators_ = 0;
  TellLimit told_;        // simulators
  bool refused_ = false;  // another one, and that was said
};

}  // namespace lk::emulator

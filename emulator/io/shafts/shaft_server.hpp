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

#include "emulator/io/live/world.hpp"
#include "emulator/io/shafts/shaft_body.hpp"
#include "emulator/io/transports/socket_listener.hpp"

namespace lk::emulator {

/// Connects the shafts of all drives to one simulator at a time (docs/guides/your-simulator.md).
/// Runs on the loop of the world, which no simulator can stop or delay. Before the first simulator,
/// the drives have the loads of their robot file.
class ShaftServer {
 public:
  /// Throws StartError if it cannot listen at the address in `options`.
  ShaftServer(boost::asio::io_context& loop, World& world, const ShaftOptions& options);
  ShaftServer(const ShaftServer&) = delete;
  ShaftServer& operator=(const ShaftServer&) = delete;
  ~ShaftServer();

  /// Call after the start of the world. With ShaftsLost::kStop, time then waits for a simulator.
  void start();
  /// Returns the address for simulators: "unix:/tmp/shafts", "tcp:127.0.0.1:29600".
  const std::string& place() const { return place_; }

 private:
  struct Shaft {
    std::size_t bus;
    int id;
    std::string name;
    const ServoConfig* servo;
  };
  /// The connected simulator.
  struct Simulator {
    Simulator(boost::asio::io_context& loop, int fd, std::uint32_t joints, unsigned its_number)
        : socket(loop, fd), reader(joints), number(its_number) {}
    boost::asio::posix::stream_descriptor socket;
    ShaftReader reader;
    unsigned number;
    std::optional<ShaftAccept> accepted;
    std::vector<std::size_t> taken;  // indices in `shafts_` of the joints that it has accepted
    ShaftBody* body = nullptr;       // owned by the world's coupling; null before the first STATES
    std::uint64_t steps_done = 0;
    std::uint64_t answers = 0;    // number that the next STATES must have
    bool states_pending = true;   // the server waits for STATES
    bool late = false;            // it has missed a deadline; the warning is logged
    bool is_not_reading = false;  // its receive buffer is full: it does not read
    bool may_log = true;          // messages about it may be logged (LogLimit)
  };

  model::MountedShaft now(const Shaft& shaft) const;
  bool is_stiff(const Shaft& shaft) const;
  void listen(const ShaftOptions& options);
  void accept_simulator(int fd);
  void wait_readable();
  void read_all();
  bool is_here(unsigned number) const { return simulator_ && simulator_->number == number; }
  /// Returns true if the socket may hold more bytes.
  bool read_some();
  void on_message(ShaftReader::Message message);
  void on_accept(ShaftAccept accept);
  void on_states(const ShaftStates& states);
  void begin(const ShaftStates& states);
  /// Callback World::on_body_step. Returns false if the drives must wait for STATES.
  bool end_step();
  void on_step_timeout();
  void send_torques();
  void step_clock();
  void take_clock();
  void send(const ShaftBytes& bytes);
  /// Disconnects the simulator and logs `why`; sends it an END with `why` if `at_fault`.
  void disconnect(const std::string& why, bool at_fault);
  void on_closed();
  /// Logs "the simulator `why`" and disconnects it.
  void release(spdlog::level::level_enum level, const std::string& why);
  /// Ends the coupling. Drives keep the last inertia of their joint as load, without torque.
  void uncouple_drives();
  bool owns_time() const {
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
  boost::asio::steady_timer first_states_timer_;  // time-out before the first STATES
  WakeTimer step_timer_;  // time-out for STATES while the drives own the time
  MonoTime step_deadline_{0};
  MonoTime poll_until_{0};
  ClockMode clock_before_;
  bool clock_is_stopped_ = false;  // by this server, until a simulator connects
  bool step_is_due_ = false;       // STATES came while the clock was still advancing
  SimTime step_{std::chrono::milliseconds(1)};
  unsigned simulators_ = 0;
  LogLimit log_limit_;    // limits messages about simulators
  bool refused_ = false;  // a second simulator was refused; the warning is logged
};

}  // namespace lk::emulator

#pragma once

#include <poll.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/coupling/coupling.hpp"
#include "emulator/io/live/line.hpp"
#include "emulator/io/live/pacer.hpp"

namespace lk::emulator {

/// All buses of a process, their common clock, and the body that couples their drives. All
/// functions and callbacks run on the event loop `loop`.
class World {
 public:
  World(boost::asio::io_context& loop, ClockMode mode);
  /// Pre: `start` was not called yet.
  Line& add(const BusConfig& bus);

  const std::vector<std::unique_ptr<Line>>& lines() const { return lines_; }
  const SimClock& clock() const { return clock_; }
  /// Time that all lines have reached: the earliest of theirs.
  SimTime time() const;
  /// Body whose joints the drives turn; null: none, or `start` was not called yet.
  const Mechanism* body() const { return coupling_ ? coupling_->body() : nullptr; }

  /// Starts time, with the coupling of the lines if the robot needs one.
  void start();
  /// Stops time for good: nothing more happens on the buses.
  void stop();
  bool stopped() const { return stopped_; }

  /// Processes the received frames of line `index`, sends replies, and polls briefly for more
  /// frames.
  void serve(std::size_t index);
  /// Whether `serve_all` reads the sockets always, or only during traffic and while a line is
  /// watched.
  enum class Sockets : std::uint8_t { kAll, kOfBusyLines };
  /// Takes the frames that have arrived, and advances all lines to the present.
  void serve_all(Sockets sockets = Sockets::kAll);

  /// Changes the mode of the clock now. Cancels an advance.
  void set_clock(ClockMode mode);

  enum class Advanced : std::uint8_t {
    kReached,    // time is `to`, and the interfaces have taken all replies
    kCancelled,  // by `end_advance`, `set_clock` or `stop`
    kStuck,      // replies cannot leave: the disk or an interface does not take them
  };
  using OnAdvanced = std::function<void(Advanced)>;
  /// Pre: the clock is stepped, and no other advance runs. Advances time to `to`, after taking the
  /// frames that hosts sent before the call. Calls `done` once, from the loop.
  void advance(SimTime to, OnAdvanced done);
  bool advancing() const { return advance_.has_value(); }
  /// Ends the running advance, if any: calls its `done` with `how`.
  void end_advance(Advanced how = Advanced::kCancelled);

  /// Couples these drives to the joints of `body`, from the next multiple of the body's step on.
  void couple(std::unique_ptr<Mechanism> body, std::span<const CoupledDrive> drives);
  void uncouple();
  const Coupling* coupling() const { return coupling_ ? &*coupling_ : nullptr; }
  /// Called when the drives have done a step; returns true if the next step may begin at once. Else
  /// time waits for `body_is_ready`. Must not couple or uncouple. Empty: as if it returned true.
  std::function<bool()> on_body_step;
  /// Lets the next step of the body begin.
  void body_is_ready();

  /// Owner of the clock, for the 409 message; empty if free.
  std::string clock_owner;

  /// Longest wait of an advance in which no reply can be sent; it then ends with kStuck.
  static constexpr auto kReplyTimeout = std::chrono::seconds(5);

 private:
  struct Advance {
    SimTime to;
    OnAdvanced done;
    unsigned number;
    std::optional<MonoTime> deadline;  // time-out, postponed with each reply sent
    std::uint64_t sent;                // replies sent by all ports at the last check
  };

  void poll_sockets();
  MonoTime next_due() const;
  struct Taken {
    bool any = false;   // frames were taken
    bool more = false;  // the port may hold more
  };
  Taken take_in(Line& line, Port::Wait wait = Port::Wait::kNot);
  SimTime follow_clock(Line& line);
  void advance_to_now(Line& line);
  /// Advances all lines and the body of their drives. Returns kBlocked also if time has to wait for
  /// `body_is_ready`.
  Line::Progress advance_all_to(SimTime until, MonoTime deadline, Line::WaitPolicy policy);
  bool waits_for_body() const { return coupling_ && !coupling_->under_way() && !body_is_ready_; }
  void continue_advance();
  void post_continue_advance();
  bool busy() const;
  void arm_timer();

  boost::asio::io_context& loop_;
  MonoTime seen_;  // latest known monotonic time
  MonoTime last_frame_;
  SimClock clock_;
  StampClock stamps_;
  std::vector<pollfd> sockets_;  // by line
  SlipReporter slip_reporter_;
  std::vector<std::unique_ptr<Line>> lines_;
  std::vector<Bus*> buses_;           // by line
  std::optional<Coupling> coupling_;  // for a body, a common battery, or a simulator
  bool body_is_ready_ = false;        // the next step may begin
  WakeTimer timer_;
  boost::asio::steady_timer reply_timer_;
  std::optional<Advance> advance_;
  unsigned advances_ = 0;
  bool stopped_ = false;
};

/// Returns the line whose bus has this name; null: none.
Line* find_line(const World& world, const std::string& bus);

}  // namespace lk::emulator

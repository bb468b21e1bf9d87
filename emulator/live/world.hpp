#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/coupling/coupling.hpp"
#include "emulator/live/line.hpp"
#include "emulator/live/pacer.hpp"
#include "emulator/live/stamp_clock.hpp"

namespace lk::emulator {

/// All lines of a process and the clock they go by, on the process's one loop.
class World {
 public:
  World(boost::asio::io_context& loop, ClockMode mode);
  /// Before time begins.
  Line& add(const BusConfig& bus);

  std::vector<std::unique_ptr<Line>>& lines() { return lines_; }
  const std::vector<std::unique_ptr<Line>>& lines() const { return lines_; }
  Line* find_line(const std::string& bus);
  const SimClock& clock() const { return clock_; }
  /// How far all lines have got.
  SimTime time() const;
  /// What drives turn the joints of, as it is now; null: nothing, or time has not begun.
  const Mechanism* body() const { return coupling_ ? coupling_->body() : nullptr; }

  /// Time begins.
  void start();
  /// Time ends: nothing happens on the buses any more.
  void stop();
  bool stopped() const { return stopped_; }

  /// There are frames on a line: takes them in, lets the replies out, and stays for what follows.
  void serve(std::size_t index);
  /// Brings all lines to now, with everything that has arrived.
  void serve_all();

  /// Goes on from the present instant. An advance that is under way ends there.
  void set_clock(ClockMode mode);

  enum class Advanced : std::uint8_t {
    kThere,      // and all replies up to then have been handed to the interfaces
    kCancelled,  // by `cancel_advance`, by another clock, by the end
    kStuck,      // replies do not leave: the disk or an interface does not take them
  };
  using OnAdvanced = std::function<void(Advanced)>;
  /// Of a stepped clock: time moves to `to`. What hosts have sent before is on the buses then.
  /// `done` is called once, from the loop. One at a time.
  void advance(SimTime to, OnAdvanced done);
  bool advancing() const { return advance_.has_value(); }
  void cancel_advance() { end_advance(Advanced::kCancelled); }
  /// How long an advance waits for replies that do not leave.
  static constexpr auto kMostPatience = std::chrono::seconds(5);

 private:
  struct Advance {
    SimTime to;
    OnAdvanced done;
    unsigned number;
    std::optional<MonoTime> give_up;  // when replies stop leaving
    std::uint64_t sent;               // replies that had left when it last waited
  };

  void wake();
  void linger();
  bool only_frames_are_waited_for() const;
  MonoTime next_due() const;
  struct Taken {
    bool any = false;
    bool more = false;  // there may be
  };
  Taken take_in(Line& line, CanSocket::Wait wait = CanSocket::Wait::kNot);
  SimTime follow_clock(Line& line);
  void bring_to_now(Line& line);
  void bring_on(Line& line);
  /// All lines, and the body that drives of them are on.
  Line::Progress bring_all_to(SimTime until, MonoTime deadline, Line::Patience patience);
  void couple();
  void exchange();
  void take_in_all();
  void go_on();
  void go_on_soon();
  /// One slice of an advance.
  Line::Progress move(MonoTime deadline);
  std::uint64_t replies_sent() const;
  void wait_for_replies();
  void end_advance(Advanced how);
  bool busy() const;
  void arm_timer();

  boost::asio::io_context& loop_;
  MonoTime seen_;  // what monotonic time has reached, as far as is known
  MonoTime last_frame_;
  SimClock clock_;
  StampClock stamps_;
  std::vector<pollfd> sockets_;  // by line
  SlipReporter slip_reporter_;
  std::vector<std::unique_ptr<Line>> lines_;
  std::vector<Bus*> buses_;           // of the lines
  std::optional<Coupling> coupling_;  // since time began, where the robot has a body
  WakeTimer timer_;
  boost::asio::steady_timer patience_;
  std::optional<Advance> advance_;
  unsigned advances_ = 0;
  bool stopped_ = false;
};

}  // namespace lk::emulator

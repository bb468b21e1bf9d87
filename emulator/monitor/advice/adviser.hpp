#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/terminal_flag.hpp"
#include "emulator/monitor/advice/advice.hpp"

namespace lk::emulator {

class Bus;

/// Recognises mistakes of hosts on one bus. Uses only the frames and the state of the drives, and a
/// bounded amount of memory. Gives each advice once for each drive.
class Adviser {
 public:
  explicit Adviser(const BusConfig& config);
  Adviser(const Adviser&) = delete;
  Adviser& operator=(const Adviser&) = delete;
  Adviser(Adviser&&) noexcept;
  Adviser& operator=(Adviser&&) noexcept;
  ~Adviser();

  /// Processes a frame that a host puts on the bus at `in.at`.
  void on_query(const TimedFrame& in);
  /// Processes wrong terminal settings `flags` of the host that sent `in`, the last frame.
  void on_terminal_flags(const TerminalFlags& flags, const TimedFrame& in);
  /// Processes a reply of a drive on this bus.
  void on_reply(const TimedFrame& reply);
  /// Notes that simulated time had fallen behind real time and was not made up (a slip). Frames
  /// that hosts sent during the slip come late, and together.
  void note_slip(SimTime now);
  /// Number of hosts' frames so far, which is the number of the last one.
  std::uint64_t query_count() const;
  /// Reads the state of drives that got frames and of one other drive in turn. Does nothing if the
  /// last observation is less than kObservePeriod ago. Pre: `bus` is settled.
  void observe(const Bus& bus);
  static constexpr SimTime kObservePeriod = std::chrono::milliseconds(1);

  /// Returns all advice, ordered by its first occurrence.
  const std::vector<Advice>& advice() const;
  /// Number of mistakes that `advice` had no room for.
  std::uint64_t left_out() const;
  /// Returns AdviceRow::word for the mistake in frame `number`; empty if no mistake is known so
  /// far, or the frame is too old.
  std::string_view mark_of(std::uint64_t number) const;

 private:
  class Impl;  // hides the watchers
  std::unique_ptr<Impl> impl_;
};

}  // namespace lk::emulator

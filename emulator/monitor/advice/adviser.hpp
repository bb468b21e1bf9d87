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

/// Recognises mistakes of hosts on one bus from their frames and the state of the drives. Depends
/// on nothing else; memory is bounded. Gives each advice once for each drive.
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
  /// Processes terminal settings `flags` of the host that wrote `in`, the last frame.
  void on_terminal_flags(const TerminalFlags& flags, const TimedFrame& in);
  /// Processes a reply of a drive on this bus.
  void on_reply(const protocol::Frame& reply);
  /// Notes that time has slipped: frames that hosts sent meanwhile come late, and together.
  void note_slip(SimTime now);
  /// Number of the last frame, counted from 1.
  std::uint64_t query_count() const;
  /// Reads the drives that got frames, at most every kObservePeriod. Pre: `bus` is settled.
  void observe(const Bus& bus);
  static constexpr SimTime kObservePeriod = std::chrono::milliseconds(1);

  /// In the order in which they were first given.
  const std::vector<Advice>& advice() const;
  /// Number of mistakes without room in `advice`.
  std::uint64_t left_out() const;
  /// Returns the word for the mistake in frame `number`; empty if there is none, none yet, or the
  /// frame is too old.
  std::string_view mark_of(std::uint64_t number) const;

 private:
  class Impl;  // hides the watchers
  std::unique_ptr<Impl> impl_;
};

}  // namespace lk::emulator

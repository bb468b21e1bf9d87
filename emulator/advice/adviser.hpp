#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "emulator/advice/advice.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/ground/terminal_flag.hpp"

namespace lk::emulator {

class Bus;

/// Hears what hosts say on one bus, looks at its drives, and recognises mistakes. A pure function
/// of the frames and the looks; its memory does not grow with time. Once for each kind and drive.
class Adviser {
 public:
  explicit Adviser(const BusConfig& config);
  Adviser(const Adviser&) = delete;
  Adviser& operator=(const Adviser&) = delete;
  Adviser(Adviser&&) noexcept;
  Adviser& operator=(Adviser&&) noexcept;
  ~Adviser();

  /// A host puts `in.frame` on the bus at `in.at`.
  void hear(const TimedFrame& in);
  /// The host whose terminal is set to `flags` has written `in`, which was heard last.
  void hear_terminal(const TerminalFlags& flags, const TimedFrame& in);
  /// A drive here has put `reply` on the bus.
  void hear_reply(const protocol::Frame& reply);
  /// Simulated time has slipped: frames that hosts sent meanwhile come late, and at once.
  void note_slip(SimTime now);
  /// The number of the frame heard last, from 1 on.
  std::uint64_t heard() const;
  /// At the drives that were spoken to, every kLookStep at most; `bus` must be settled.
  void look(const Bus& bus);
  static constexpr SimTime kLookStep = std::chrono::milliseconds(1);

  /// In the order in which it was first given.
  const std::vector<Advice>& given() const;
  /// How often a host did something wrong that `given` has no room for.
  std::uint64_t left_out() const;
  /// The word of what was wrong with a frame, by its number; empty when nothing was, is known yet,
  /// or when it is too long ago.
  std::string_view mark_of(std::uint64_t number) const;

 private:
  class Desk;  // what watchers there are is nobody else's business
  std::unique_ptr<Desk> desk_;
};

}  // namespace lk::emulator

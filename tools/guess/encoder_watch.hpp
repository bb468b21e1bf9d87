#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Finds the width of a drive's encoder field, and which turn it spans. Its memory is bounded.
class EncoderWatch {
 public:
  /// Processes the encoder field of a reply; `speed_dps` if the reply has it.
  void field(std::uint16_t counts, std::optional<int> speed_dps, std::optional<SimTime> at);
  /// Processes a reply to 0x92. Returns the turn that the steps of the field and of 0x92 show.
  std::optional<EncoderSpan> angle(std::int64_t angle_cdeg, std::optional<SimTime> at);

  /// Returns the largest value of the field; empty if no reply had it.
  std::optional<std::uint16_t> largest() const { return largest_; }
  /// Returns the counts of the field per 360° of 0x92; empty if the shaft turned too little.
  std::optional<double> counts_per_turn() const;

 private:
  struct Field {
    std::uint16_t counts = 0;
    std::optional<int> speed_dps;
    std::optional<SimTime> at;
  };
  struct Place {
    double angle_cdeg = 0;
    int counts = 0;
  };

  std::optional<std::uint16_t> largest_;
  std::optional<Field> last_;
  std::optional<Place> from_;
  std::vector<double> per_turn_;
};

}  // namespace lk::emulator

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// How wide the encoder field of a drive is, and which turn it spans. Its size does not grow with
/// time.
class EncoderWatch {
 public:
  /// The encoder field of a reply; `speed_dps` where the reply has it.
  void field(std::uint16_t counts, std::optional<int> speed_dps, std::optional<SimTime> at);
  /// The reply to 0x92. Returns the turn that a step of the field and of 0x92 together show.
  std::optional<EncoderSpan> angle(std::int64_t angle_cdeg, std::optional<SimTime> at);

  /// The largest value of the field; none: no reply had the field.
  std::optional<std::uint16_t> largest() const { return largest_; }
  /// Counts of the field per 360° of 0x92; none: the log does not have the shaft turn enough.
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

#include "emulator/core/sim_time.hpp"

#include <cstdint>

namespace lk::emulator {

std::string seconds_text(SimTime time) {
  constexpr std::int64_t kNanos = 1'000'000'000;
  const std::int64_t magnitude = time.count() < 0 ? -time.count() : time.count();
  std::string text = (time.count() < 0 ? "-" : "") + std::to_string(magnitude / kNanos);
  std::string decimals = std::to_string(kNanos + magnitude % kNanos).substr(1);
  decimals.erase(decimals.find_last_not_of('0') + 1);
  return decimals.empty() ? text : text + '.' + decimals;
}

std::string time_text(SimTime time) { return seconds_text(time) + " s"; }

}  // namespace lk::emulator

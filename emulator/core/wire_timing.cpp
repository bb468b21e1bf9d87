#include "emulator/core/wire_timing.hpp"

#include <algorithm>
#include <cassert>

#include "protocol/rounding.hpp"

namespace lk::emulator {

constexpr std::int64_t kNsPerS = 1'000'000'000;

SimTime bits_duration(std::int64_t bits, std::int64_t bitrate) {
  assert(bits >= 0 && bitrate >= 0);
  if (bitrate == 0) return SimTime{0};
  return SimTime{(bits * kNsPerS + bitrate - 1) / bitrate};
}

std::int64_t ticks_until(SimTime t, std::int64_t f_Hz) {
  assert(t.count() >= 0 && f_Hz > 0);
  // Split off whole seconds: t·f overflows 64 bits after 80 hours at 32 kHz.
  const std::int64_t seconds = t.count() / kNsPerS;
  const std::int64_t rest_ns = t.count() % kNsPerS;
  return seconds * f_Hz + rest_ns * f_Hz / kNsPerS;
}

SimTime time_of_tick(std::int64_t n, std::int64_t f_Hz) {
  assert(n >= 0 && f_Hz > 0);
  const std::int64_t rest = n % f_Hz;
  return SimTime{n / f_Hz * kNsPerS + (rest * kNsPerS + f_Hz - 1) / f_Hz};
}

namespace {

/// Time of a frame as text at 115200 baud, "tIIILDD..DD\r": 22 characters of 10 bits.
constexpr double kSlcanFrame_us = 22 * 10 * 1e6 / 115'200;
/// Buffer of the FTDI chip, bytes: a USB packet of 64 bytes minus two status bytes.
constexpr std::size_t kFtdiBuffer = 62;

// clang-format off
constexpr AdapterProfile kProfiles[] = {
    {.name = "none", .times = {}, .source = "frames reach host and wire at once"},
    {.name = "ch348", .times = {.tx_us = 260, .rx_us = 280, .jitter_us = 60, .tail_us = 3500, .tail_probability = 1.0 / 4000},
     .source = "fitted to a robot of twelve MG4005: three drives polled at 415-443 Hz, worst cycle 5.6-6.0 ms"},
    {.name = "ftdi_default", .times = {.batch_us = 16'000, .batch_most = kFtdiBuffer}, .source = "the chip's latency timer as delivered, 16 ms"},
    {.name = "ftdi_1ms", .times = {.batch_us = 1000, .batch_most = kFtdiBuffer}, .source = "the chip's latency timer as it is commonly set, 1 ms"},
    {.name = "slcan_115200", .times = {.frame_us = kSlcanFrame_us}, .source = "computed: 22 characters a frame, 523 frames/s at most"},
    {.name = "usb_can", .times = {.batch_us = 1000}, .source = "frame time of USB full speed, 1 ms"},
    {.name = "usb_can_hs", .times = {.batch_us = 125}, .source = "microframe of USB high speed, 125 us"},
};
// clang-format on

/// Returns the smaller limit; 0 means no limit.
template <class T>
T smaller(T one, T other) {
  return one == 0 ? other : other == 0 ? one : std::min(one, other);
}

}  // namespace

SimTime AdapterTimes::worst_round_trip() const {
  const double tails_us = tail_probability > 0 ? 2 * tail_us : 0;
  const double most_us = tx_us + rx_us + 2 * jitter_us + tails_us + 2 * frame_us + batch_us;
  return SimTime(protocol::rounded(most_us * 1e3));
}

AdapterTimes add(const AdapterTimes& one, const AdapterTimes& other) {
  AdapterTimes sum = one;
  sum.tx_us += other.tx_us;
  sum.rx_us += other.rx_us;
  sum.jitter_us += other.jitter_us;
  sum.tail_us = std::max(sum.tail_us, other.tail_us);
  sum.tail_probability = std::max(sum.tail_probability, other.tail_probability);
  sum.frame_us = std::max(sum.frame_us, other.frame_us);
  sum.batch_us = std::max(sum.batch_us, other.batch_us);
  sum.batch_most = smaller(sum.batch_most, other.batch_most);
  sum.depth = smaller(sum.depth, other.depth);
  sum.tx_depth = smaller(sum.tx_depth, other.tx_depth);
  sum.reports_overrun = sum.reports_overrun && other.reports_overrun;
  sum.stall_every = smaller(sum.stall_every, other.stall_every);
  sum.stall_us = std::max(sum.stall_us, other.stall_us);
  return sum;
}

std::span<const AdapterProfile> adapter_profiles() { return kProfiles; }

const AdapterProfile* find_adapter(std::string_view name) {
  const auto found = std::ranges::find(kProfiles, name, &AdapterProfile::name);
  return found != std::end(kProfiles) ? &*found : nullptr;
}

}  // namespace lk::emulator

#include "emulator/io/live/pacer.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <ctime>
#include <system_error>

#include "emulator/io/transports/port.hpp"

namespace lk::emulator {
namespace {

constexpr MonoTime kEpisodeGap = std::chrono::seconds(1);

double in_ms(SimTime time) { return std::chrono::duration<double, std::milli>(time).count(); }

timespec to_timespec(MonoTime time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  return {static_cast<time_t>(seconds.count()), static_cast<long>((time - seconds).count())};
}

}  // namespace

MonoTime monotonic_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

std::optional<ClockMode> parse_clock_mode(std::string_view text) {
  if (text == "realtime") return ClockMode{};
  if (text == "stepped") return ClockMode{.stepped = true};
  if (!text.starts_with('x')) return std::nullopt;
  double factor = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data() + 1, last, factor);
  if (error != std::errc() || end != last) return std::nullopt;
  if (!(factor >= kSlowestClock && factor <= kFastestClock)) return std::nullopt;
  return ClockMode{.factor = factor};
}

std::string to_string(const ClockMode& mode) {
  if (mode.stepped) return "stepped";
  return mode.factor == 1 ? "realtime" : fmt::format("x{}", mode.factor);
}

SimTime SimClock::span(MonoTime wall) const {
  if (mode_.stepped) return SimTime{0};
  if (mode_.factor == 1) return wall;
  return SimTime(static_cast<std::int64_t>(static_cast<double>(wall.count()) * mode_.factor));
}

SimTime SimClock::time_at(MonoTime mono) const {
  if (mode_.stepped) return base_;
  return std::chrono::floor<std::chrono::microseconds>(base_ + span(mono - epoch_));
}

SimClock::Reading SimClock::read(MonoTime mono, SimTime reached) {
  const SimTime now = time_at(mono);
  if (mode_.stepped) return {now, SimTime{0}};
  if (now - reached <= span(kMaxLag)) return {now, SimTime{0}};
  const SimTime slip = now - reached;
  base_ -= slip;
  total_slip_ += slip;
  ++slips_;
  return {reached, slip};
}

MonoTime SimClock::to_mono(SimTime time) const {
  if (mode_.stepped) return MonoTime::max();
  const SimTime wait = std::chrono::ceil<std::chrono::microseconds>(time) - base_;
  if (mode_.factor == 1) return epoch_ + wait;
  const double ns = std::ceil(static_cast<double>(wait.count()) / mode_.factor);
  constexpr double kFar = 4e18;  // below the largest MonoTime
  return ns < kFar - static_cast<double>(epoch_.count())
             ? epoch_ + MonoTime(static_cast<std::int64_t>(ns))
             : MonoTime::max();
}

void SimClock::switch_to(ClockMode mode, MonoTime mono, SimTime at) {
  mode_ = mode;
  epoch_ = mono;
  base_ = at;
}

void SlipReporter::slipped(MonoTime mono, SimTime by) {
  if (episode_ == SimTime{0}) {
    spdlog::warn("behind by {:.0f} ms: simulated time slips (stopped, or the machine is too busy)",
                 in_ms(by));
  }
  episode_ += by;
  last_ = mono;
}

void SlipReporter::check(MonoTime mono) {
  if (episode_ == SimTime{0} || mono - last_ < kEpisodeGap) return;
  spdlog::info("keeping up again; simulated time slipped by {:.0f} ms", in_ms(episode_));
  episode_ = SimTime{0};
}

WakeTimer::WakeTimer(boost::asio::io_context& loop, std::function<void()> on_wake)
    : timer_(loop), on_wake_(std::move(on_wake)) {
  const int fd = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "timerfd");
  timer_.assign(fd);
}

void WakeTimer::wake_by(MonoTime mono, MonoTime now) {
  if (armed_ && armed_at_ <= mono && armed_at_ > now) return;
  // Zero would disarm the timer.
  const itimerspec setting{{}, to_timespec(std::max(mono, MonoTime{1}))};
  if (::timerfd_settime(timer_.native_handle(), TFD_TIMER_ABSTIME, &setting, nullptr) < 0) {
    throw std::system_error(errno, std::generic_category(), "timerfd_settime");
  }
  if (!armed_) wait();
  armed_ = true;
  armed_at_ = mono;
}

void WakeTimer::wait() {
  timer_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                    [this](const boost::system::error_code& error) {
                      if (error) return;  // the loop ends
                      armed_ = false;     // rearming also clears the expiry
                      on_wake_();
                    });
}

StampClock::Reading StampClock::read_clocks() {
  constexpr int kTries = 3;  // the process may be delayed between the two readings
  constexpr MonoTime kClose = std::chrono::microseconds(50);
  Reading best{};
  MonoTime best_gap = MonoTime::max();
  MonoTime before = monotonic_now();
  for (int n = 0; n < kTries && best_gap > kClose; ++n) {
    const std::chrono::nanoseconds wall = wall_now();
    const MonoTime mono = monotonic_now();
    if (mono - before < best_gap) {
      best = {wall, mono};
      best_gap = mono - before;
    }
    before = mono;
  }
  return best;
}

MonoTime StampClock::reached(std::chrono::nanoseconds stamp, MonoTime seen) {
  const MonoTime mono = stamp - ahead_;
  const bool holds = compared_ != MonoTime::min() && mono - compared_ < kHolds;
  if (holds && mono >= seen - kBelievable && mono <= seen + kBelievable) {
    return std::max(mono, seen);
  }
  const Reading now = read_();
  ahead_ = now.wall - now.mono;
  compared_ = now.mono;
  return std::max(now.mono, seen);
}

MonoTime StampClock::arrival(std::chrono::nanoseconds stamp, MonoTime now) const {
  const MonoTime mono = stamp - ahead_;
  return mono > now || now - mono > kOldest ? now : mono;
}

}  // namespace lk::emulator

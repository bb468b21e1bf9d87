#include "emulator/pacer.hpp"

#include <spdlog/spdlog.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <system_error>

namespace lk::emulator {
namespace {

constexpr MonoTime kEpisodeGap = std::chrono::seconds(1);

double in_ms(SimTime time) { return std::chrono::duration<double, std::milli>(time).count(); }

timespec to_timespec(MonoTime time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  return {static_cast<time_t>(seconds.count()), static_cast<long>((time - seconds).count())};
}

}  // namespace

MonoTime monotonic_now() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

SimClock::Reading SimClock::read(MonoTime mono, SimTime reached) {
  const SimTime now = std::chrono::floor<std::chrono::microseconds>(mono - epoch_);
  if (now - reached <= kMostLag) return {now, SimTime{0}};
  const SimTime slip = now - reached;
  epoch_ += slip;
  total_slip_ += slip;
  ++slips_;
  return {reached, slip};
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

void WakeTimer::wake_by(MonoTime mono) {
  if (armed_ && armed_at_ <= mono) return;
  // A time of zero would disarm it.
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
                      if (error) return;  // the loop is going away
                      armed_ = false;     // arming it anew also clears its expiry
                      on_wake_();
                    });
}

}  // namespace lk::emulator

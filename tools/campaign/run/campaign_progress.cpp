#include "tools/campaign/run/campaign_progress.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <string>

namespace lk::emulator {
namespace {

/// "2 h 5 min", "1 min 9 s", "12 s"
std::string left_text(double seconds) {
  const auto whole = static_cast<std::uint64_t>(seconds + 0.5);
  if (whole >= 3600) return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
  if (whole >= 60) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} s", whole);
}

}  // namespace

CampaignProgress::CampaignProgress(std::uint64_t in_all, std::uint64_t before, bool wanted)
    : in_all_(in_all),
      before_(before),
      wanted_(wanted),
      began_(std::chrono::steady_clock::now()),
      next_(began_ + std::chrono::seconds(1)) {}

CampaignProgress::~CampaignProgress() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

void CampaignProgress::show(std::uint64_t ran) {
  const auto now = std::chrono::steady_clock::now();
  if (!wanted_ || now < next_) return;
  next_ = now + std::chrono::milliseconds(500);
  shown_ = true;
  const double rate =
      static_cast<double>(ran) / std::chrono::duration<double>(now - began_).count();
  const std::uint64_t done = before_ + ran;
  const double left = in_all_ > done ? static_cast<double>(in_all_ - done) / rate : 0;
  std::fputs(
      fmt::format("\r\033[K{} of {} cases, {:.3g}/s, {} left", done, in_all_, rate, left_text(left))
          .c_str(),
      stderr);
  std::fflush(stderr);
}

}  // namespace lk::emulator

#include "emulator/transports/tell_limit.hpp"

#include <spdlog/spdlog.h>

namespace lk::emulator {

bool TellLimit::may_tell(const std::string& whom) {
  constexpr unsigned kMost = 20;
  constexpr auto kAnew = std::chrono::seconds(10);
  const auto now = std::chrono::steady_clock::now();
  if (told_ == 0 || now - since_ > kAnew) {
    since_ = now;
    told_ = 0;
  }
  ++told_;
  if (told_ == kMost + 1) spdlog::warn("{}: no more of this is told for a while", whom);
  return told_ <= kMost;
}

}  // namespace lk::emulator

#pragma once

#include <chrono>
#include <cstdint>

namespace lk::emulator {

/// One line on standard error that says how far a campaign has come, how fast, and what is left.
class CampaignProgress {
 public:
  /// Of `in_all` cases `before` were done already.
  CampaignProgress(std::uint64_t in_all, std::uint64_t before, bool wanted);
  CampaignProgress(const CampaignProgress&) = delete;
  CampaignProgress& operator=(const CampaignProgress&) = delete;
  ~CampaignProgress();  // takes the line away

  /// So many cases have been run now.
  void show(std::uint64_t ran);

 private:
  std::uint64_t in_all_;
  std::uint64_t before_;
  bool wanted_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point began_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace lk::emulator

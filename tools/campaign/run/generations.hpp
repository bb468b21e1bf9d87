#pragma once

#include <cstdint>
#include <functional>

#include "tools/campaign/run/campaign_progress.hpp"
#include "tools/campaign/run/campaign_run.hpp"

namespace lk::emulator {

/// Runs what the store does not have of a plan of `adaptive`, generation after generation. Returns
/// how many cases that were.
std::uint64_t run_generations(const Plan& plan, CampaignStore& store,
                              const CampaignOptions& options,
                              const std::function<CaseRunner()>& runner,
                              CampaignProgress& progress);

}  // namespace lk::emulator

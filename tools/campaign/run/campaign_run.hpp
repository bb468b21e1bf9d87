#pragma once

/// @file A campaign on one machine: which cases are left, who computes them, where results go.

#include <cstdint>
#include <functional>
#include <span>
#include <thread>
#include <vector>

#include "tools/campaign/plan/plan.hpp"
#include "tools/campaign/results/campaign_store.hpp"
#include "tools/campaign/run/offline.hpp"

namespace lk::emulator {

/// Runs cases, in a thread of its own, and hands over what is finished as it goes.
using CaseRunner = std::function<void(std::span<const CaseToRun>, const ResultTaker&)>;

struct CampaignOptions {
  int jobs = 1;
  Shard shard;  // of `adaptive`: one generation
  // Of a generation of `adaptive` that is run as a shard: the results of those before. Else null.
  const CampaignStore* earlier = nullptr;
  bool progress = false;  // on standard error
};

/// What became of a run.
struct CampaignEnd {
  std::uint64_t ran = 0;     // cases, of this run
  std::uint64_t before = 0;  // that were in the store already
  bool interrupted = false;  // by SIGINT or SIGTERM
  double wall_s = 0;
};

/// How many generations a plan of `adaptive` has.
std::uint64_t generations_of(const Plan& plan);

/// Runs what the store does not have yet. `runner` makes a runner for a thread; what it throws ends
/// the run and comes out here, with all that has been finished stored.
CampaignEnd run_campaign(const Plan& plan, CampaignStore& store, const CampaignOptions& options,
                         const std::function<CaseRunner()>& runner);

/// `count` threads. Throws StartError where the system has no room for so many; those that were
/// started have to come to their end by themselves then.
void start_threads(std::vector<std::jthread>& threads, int count,
                   const std::function<void()>& work);

/// Threads that each take the next pile of cases; what they give goes to `done`, on the calling
/// thread, in any order. Ends early when `stop` says so. Throws StartError when there is no room
/// for so many threads.
void run_in_threads(int jobs, const std::function<CaseRunner()>& runner,
                    const std::function<std::vector<CaseToRun>()>& next_pile,
                    const std::function<void(const std::vector<CaseResult>&)>& done,
                    const std::function<bool()>& stop);

}  // namespace lk::emulator

#include "tools/campaign/run/campaign_run.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include "tools/campaign/plan/sampling.hpp"
#include "tools/campaign/run/campaign_progress.hpp"
#include "tools/campaign/run/generations.hpp"
#include "tools/campaign/run/interruption.hpp"

namespace lk::emulator {
namespace {

// Enough for neighbours in time to be close.
constexpr std::uint64_t kMostInPile = 128;
constexpr std::uint64_t kLeastInPile = 8;

/// The cases of a shard that the store does not have, in order.
class CasesLeft {
 public:
  CasesLeft(const Plan& plan, const CampaignStore& store, const Shard& shard)
      : numbers_(plan), store_(store), shard_(shard), next_(shard.index) {}

  std::vector<CaseToRun> take(std::uint64_t most) {
    std::vector<CaseToRun> cases;
    for (; next_ < numbers_.numbers() && cases.size() < most; next_ += shard_.of) {
      if (store_.has(next_)) continue;
      if (auto values = numbers_.values(next_)) cases.push_back({next_, 0, std::move(*values)});
    }
    return cases;
  }
  /// At most so many: those that are excluded are among them.
  std::uint64_t in_all() const {
    const std::uint64_t numbers = numbers_.numbers();
    return numbers <= shard_.index ? 0 : (numbers - shard_.index - 1) / shard_.of + 1;
  }

 private:
  CaseNumbers numbers_;
  const CampaignStore& store_;
  Shard shard_;
  std::uint64_t next_;
};

}  // namespace

CampaignEnd run_campaign(const Plan& plan, CampaignStore& store, const CampaignOptions& options,
                         const std::function<CaseRunner()>& runner) {
  const auto began = std::chrono::steady_clock::now();
  const Interruptible interruptible;
  store.note_shard(options.shard);
  CasesLeft left(plan, store, options.shard);
  CampaignEnd end;
  end.before = store.count();
  CampaignProgress progress(left.in_all(), end.before, options.progress);
  if (plan.head.sampling == Sampling::kAdaptive) {
    end.ran = run_generations(plan, store, options, runner, progress);
    end.interrupted = interrupted();
    end.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    return end;
  }
  const std::uint64_t share = left.in_all() / (4 * static_cast<std::uint64_t>(options.jobs) + 1);
  const std::uint64_t pile = plan.host ? 1 : std::clamp(share, kLeastInPile, kMostInPile);
  run_in_threads(
      options.jobs, runner, [&] { return left.take(pile); },
      [&](const std::vector<CaseResult>& results) {
        store.put(results);
        end.ran += results.size();
        progress.show(end.ran);
      },
      interrupted);
  end.interrupted = interrupted();
  end.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return end;
}

}  // namespace lk::emulator

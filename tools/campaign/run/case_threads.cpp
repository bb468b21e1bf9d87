#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <iterator>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "tools/campaign/run/campaign_run.hpp"

namespace lk::emulator {
namespace {

/// Piles on their way to the threads, and results on their way back.
class Exchange {
 public:
  /// Nothing: there is no more.
  std::optional<std::vector<CaseToRun>> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !piles_.empty() || closed_; });
    if (piles_.empty()) return std::nullopt;
    std::vector<CaseToRun> pile = std::move(piles_.front());
    piles_.pop_front();
    ++running_;
    return pile;
  }
  void give(std::vector<CaseResult> results, std::exception_ptr problem) {
    const std::scoped_lock lock(mutex_);
    --running_;
    if (problem && !problem_) problem_ = problem;
    if (!results.empty()) results_.push_back(std::move(results));
    changed_.notify_all();
  }
  void put(std::vector<CaseToRun> pile) {
    const std::scoped_lock lock(mutex_);
    piles_.push_back(std::move(pile));
    changed_.notify_all();
  }
  /// No more piles come; with `drop`, those that wait are not run either.
  void close(bool drop) {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    if (drop) piles_.clear();
    changed_.notify_all();
  }
  std::size_t waiting() {
    const std::scoped_lock lock(mutex_);
    return piles_.size();
  }
  bool failed() {
    const std::scoped_lock lock(mutex_);
    return problem_ != nullptr;
  }
  /// Results, as soon as there are any, or after a while; nothing runs any more and none are left:
  /// false.
  bool collect(std::vector<std::vector<CaseResult>>& out) {
    constexpr auto kGlance = std::chrono::milliseconds(200);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kGlance, [&] { return !results_.empty() || idle(); });
    out.assign(std::make_move_iterator(results_.begin()), std::make_move_iterator(results_.end()));
    results_.clear();
    return !out.empty() || !idle();
  }
  std::exception_ptr problem() {
    const std::scoped_lock lock(mutex_);
    return problem_;
  }

 private:
  bool idle() const { return piles_.empty() && running_ == 0; }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::vector<CaseToRun>> piles_;
  std::vector<std::vector<CaseResult>> results_;
  std::exception_ptr problem_;
  std::size_t running_ = 0;
  bool closed_ = false;
};

void work(Exchange& exchange, const std::function<CaseRunner()>& runner) {
  CaseRunner run;
  while (const auto pile = exchange.take()) {
    std::vector<CaseResult> results;
    std::exception_ptr problem;
    try {
      if (!run) run = runner();
      results = run(*pile);
    } catch (...) {
      problem = std::current_exception();
    }
    exchange.give(std::move(results), problem);
  }
}

}  // namespace

void run_in_threads(int jobs, const std::function<CaseRunner()>& runner,
                    const std::function<std::vector<CaseToRun>()>& next_pile,
                    const std::function<void(const std::vector<CaseResult>&)>& done,
                    const std::function<bool()>& stop) {
  Exchange exchange;
  std::vector<std::jthread> threads;
  struct Closing {  // whatever happens, before the threads are joined
    Exchange& exchange;
    ~Closing() { exchange.close(true); }
  };
  for (int n = 0; n < jobs; ++n) {
    threads.emplace_back([&] { work(exchange, runner); });
  }
  const Closing closing{exchange};
  bool more = true;
  std::vector<std::vector<CaseResult>> finished;
  for (;;) {
    if (more && (stop() || exchange.failed())) {
      more = false;
      exchange.close(true);
    }
    while (more && exchange.waiting() < static_cast<std::size_t>(jobs)) {
      std::vector<CaseToRun> pile = next_pile();
      more = !pile.empty();
      if (more) exchange.put(std::move(pile));
    }
    const bool busy = exchange.collect(finished);
    for (const auto& results : finished) done(results);
    if (!busy && !more) break;
  }
  if (const auto problem = exchange.problem()) std::rethrow_exception(problem);
}

}  // namespace lk::emulator

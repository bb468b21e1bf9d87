#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <iterator>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "emulator/ground/start_error.hpp"
#include "tools/campaign/run/campaign_run.hpp"

namespace lk::emulator {
namespace {

/// Piles on their way to the threads, and results on their way back.
class Exchange {
 public:
  /// Nothing: there is no more.
  std::optional<std::vector<CaseToRun>> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !piles_.empty() || dropped_; });
    if (piles_.empty()) return std::nullopt;
    std::vector<CaseToRun> pile = std::move(piles_.front());
    piles_.pop_front();
    ++running_;
    return pile;
  }
  /// Returns whether the rest of the pile is still wanted.
  bool give(std::vector<CaseResult> results) {
    const std::scoped_lock lock(mutex_);
    results_.insert(results_.end(), std::make_move_iterator(results.begin()),
                    std::make_move_iterator(results.end()));
    changed_.notify_all();
    return !dropped_;
  }
  /// A pile is done.
  void end(const std::exception_ptr& problem) {
    const std::scoped_lock lock(mutex_);
    --running_;
    if (problem && !problem_) problem_ = problem;
    changed_.notify_all();
  }
  void put(std::vector<CaseToRun> pile) {
    const std::scoped_lock lock(mutex_);
    piles_.push_back(std::move(pile));
    changed_.notify_all();
  }
  /// No more piles come; those that wait are not run either, those that run end early.
  void drop() {
    const std::scoped_lock lock(mutex_);
    dropped_ = true;
    piles_.clear();
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
  bool collect(std::vector<CaseResult>& out) {
    constexpr auto kGlance = std::chrono::milliseconds(200);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kGlance, [&] { return !results_.empty() || idle(); });
    out = std::exchange(results_, {});
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
  std::vector<CaseResult> results_;
  std::exception_ptr problem_;
  std::size_t running_ = 0;
  bool dropped_ = false;
};

void work(Exchange& exchange, const std::function<CaseRunner()>& runner) {
  CaseRunner run;
  while (const auto pile = exchange.take()) {
    std::exception_ptr problem;
    try {
      if (!run) run = runner();
      run(*pile, [&](std::vector<CaseResult> some) { return exchange.give(std::move(some)); });
    } catch (...) {
      problem = std::current_exception();
    }
    exchange.end(problem);
  }
}

}  // namespace

void start_threads(std::vector<std::jthread>& threads, int count,
                   const std::function<void()>& work) {
  threads.reserve(static_cast<std::size_t>(count));
  try {
    for (int n = 0; n < count; ++n) threads.emplace_back(work);
  } catch (const std::system_error& problem) {
    throw StartError("--jobs: " + std::to_string(threads.size()) + " of " + std::to_string(count) +
                     " threads could be started: " + problem.what() + "; ask for fewer");
  }
}

void run_in_threads(int jobs, const std::function<CaseRunner()>& runner,
                    const std::function<std::vector<CaseToRun>()>& next_pile,
                    const std::function<void(const std::vector<CaseResult>&)>& done,
                    const std::function<bool()>& stop) {
  Exchange exchange;
  std::vector<std::jthread> threads;
  struct Closing {  // whatever happens, before the threads are joined
    Exchange& exchange;
    ~Closing() { exchange.drop(); }
  };
  const Closing closing{exchange};
  start_threads(threads, jobs, [&] { work(exchange, runner); });
  bool more = true;
  std::vector<CaseResult> finished;
  for (;;) {
    if (more && (stop() || exchange.failed())) {
      more = false;
      exchange.drop();
    }
    while (more && exchange.waiting() < threads.size()) {
      std::vector<CaseToRun> pile = next_pile();
      more = !pile.empty();
      if (more) exchange.put(std::move(pile));
    }
    const bool busy = exchange.collect(finished);
    if (!finished.empty()) done(finished);
    if (!busy && !more) break;
  }
  if (const auto problem = exchange.problem()) std::rethrow_exception(problem);
}

}  // namespace lk::emulator

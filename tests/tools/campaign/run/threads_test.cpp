// Piles of cases over threads: what they give is all delivered, what they throw comes out.

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tools/campaign/run/campaign_run.hpp"

namespace lk::emulator {
namespace threads_test {

using Piles = std::function<std::vector<CaseToRun>()>;

/// Piles of one case, `count` of them, numbered from 0.
Piles piles(std::uint64_t count) {
  return [count, next = std::make_shared<std::uint64_t>(0)]() -> std::vector<CaseToRun> {
    if (*next == count) return {};
    return {{(*next)++, 0, {}}};
  };
}

std::vector<CaseResult> results_of(std::span<const CaseToRun> cases) {
  std::vector<CaseResult> results;
  for (const CaseToRun& one : cases) results.emplace_back().number = one.number;
  return results;
}

using Computing = std::function<std::vector<CaseResult>(std::span<const CaseToRun>)>;

/// A runner that hands over a pile as a whole.
CaseRunner whole(Computing run) {
  return [run = std::move(run)](std::span<const CaseToRun> cases, const ResultTaker& take) {
    take(run(cases));
  };
}

std::function<CaseRunner()> each(Computing run) {
  return [run = whole(std::move(run))] { return run; };
}

struct Delivered {
  std::multiset<std::uint64_t> numbers;
  std::thread::id thread = std::this_thread::get_id();
  std::function<void(const std::vector<CaseResult>&)> taker() {
    return [this](const std::vector<CaseResult>& results) {
      EXPECT_EQ(std::this_thread::get_id(), thread);
      for (const CaseResult& one : results) numbers.insert(one.number);
    };
  }
};

bool never() { return false; }

TEST(Threads, DeliverEachResultOnceToTheCaller) {
  std::multiset<std::uint64_t> all;
  for (std::uint64_t n = 0; n < 200; ++n) all.insert(n);
  for (const int jobs : {1, 2, 5}) {
    Delivered delivered;
    run_in_threads(jobs, each(results_of), piles(200), delivered.taker(), never);
    EXPECT_EQ(delivered.numbers, all) << jobs;
  }
}

TEST(Threads, MakeOneRunnerEach) {
  std::atomic<int> made = 0;
  Delivered delivered;
  run_in_threads(
      3,
      [&] {
        ++made;
        return whole(results_of);
      },
      piles(100), delivered.taker(), never);
  EXPECT_GE(made, 1);
  EXPECT_LE(made, 3);
}

TEST(Threads, OfNoCasesEndAtOnce) {
  Delivered delivered;
  run_in_threads(4, each(results_of), piles(0), delivered.taker(), never);
  EXPECT_TRUE(delivered.numbers.empty());
}

/// What a run ends with.
std::string problem_of(const std::function<void()>& run) {
  try {
    run();
  } catch (const std::runtime_error& problem) {
    return problem.what();
  }
  return "";
}

TEST(Threads, LetExceptionsOfARunnerOutAndKeepWhatIsFinished) {
  for (const int jobs : {1, 4}) {
    std::mutex mutex;
    std::multiset<std::uint64_t> finished;
    const Computing run = [&](std::span<const CaseToRun> cases) {
      if (cases.front().number == 20) throw std::runtime_error("case 20");
      const std::scoped_lock lock(mutex);
      finished.insert(cases.front().number);
      return results_of(cases);
    };
    Delivered delivered;
    EXPECT_EQ(problem_of([&] {
                run_in_threads(jobs, each(run), piles(1'000'000), delivered.taker(), never);
              }),
              "case 20");
    EXPECT_EQ(delivered.numbers, finished) << jobs;
    EXPECT_LT(finished.size(), 1'000'000U);
  }
}

TEST(Threads, LetExceptionsOfTheMakerOut) {
  Delivered delivered;
  const auto maker = []() -> CaseRunner { throw std::runtime_error("none is left"); };
  EXPECT_EQ(problem_of([&] { run_in_threads(2, maker, piles(10), delivered.taker(), never); }),
            "none is left");
}

// A disk that is full, or a plan whose values run out: on the calling thread.
TEST(Threads, LetExceptionsOfTheCallerOut) {
  const auto full = [](const std::vector<CaseResult>&) { throw std::runtime_error("full"); };
  EXPECT_EQ(problem_of([&] { run_in_threads(3, each(results_of), piles(1000), full, never); }),
            "full");
  const Piles broken = [next = piles(5)] {
    auto pile = next();
    if (pile.empty()) throw std::runtime_error("no more values");
    return pile;
  };
  Delivered delivered;
  EXPECT_EQ(
      problem_of([&] { run_in_threads(3, each(results_of), broken, delivered.taker(), never); }),
      "no more values");
}

TEST(Threads, StopEarlyAndDeliverWhatRuns) {
  for (const int jobs : {1, 4}) {
    std::mutex mutex;
    std::multiset<std::uint64_t> finished;
    const Computing run = [&](std::span<const CaseToRun> cases) {
      const std::scoped_lock lock(mutex);
      finished.insert(cases.front().number);
      return results_of(cases);
    };
    Delivered delivered;
    const auto enough = [&] { return delivered.numbers.size() >= 50; };
    run_in_threads(jobs, each(run), piles(1'000'000), delivered.taker(), enough);
    EXPECT_EQ(delivered.numbers, finished) << jobs;
    EXPECT_GE(finished.size(), 50U);
    EXPECT_LT(finished.size(), 1'000'000U);
  }
}

// A pile may take minutes: what of it is finished is not lost, and Ctrl-C need not wait for the
// rest.
TEST(Threads, HandOverAndStopInTheMiddleOfAPile) {
  constexpr std::uint64_t kFar = 10'000'000;
  std::multiset<std::uint64_t> given;
  const CaseRunner slow = [&](std::span<const CaseToRun>, const ResultTaker& take) {
    for (std::uint64_t n = 0; n < kFar; ++n) {
      given.insert(n);
      std::vector<CaseResult> one(1);
      one.front().number = n;
      if (!take(std::move(one))) break;
    }
  };
  Delivered delivered;
  run_in_threads(
      1, [&] { return slow; }, piles(1), delivered.taker(),
      [&] { return !delivered.numbers.empty(); });
  EXPECT_EQ(delivered.numbers, given);
  EXPECT_LT(given.size(), kFar);
}

TEST(Threads, KeepWhatWasHandedOverBeforeAnException) {
  const CaseRunner breaks = [](std::span<const CaseToRun> cases, const ResultTaker& take) {
    take(results_of(cases));
    throw std::runtime_error("later");
  };
  Delivered delivered;
  EXPECT_EQ(problem_of([&] {
              run_in_threads(
                  1, [&] { return breaks; }, piles(1), delivered.taker(), never);
            }),
            "later");
  EXPECT_EQ(delivered.numbers, std::multiset<std::uint64_t>{0});
}

TEST(Threads, ThatAreStoppedBeforehandRunNothing) {
  Delivered delivered;
  run_in_threads(2, each(results_of), piles(10), delivered.taker(), [] { return true; });
  EXPECT_TRUE(delivered.numbers.empty());
}

// What a host runner returns when it is stopped: fewer than it was given.
TEST(Threads, TakeFewerResultsThanCases) {
  const Computing run = [](std::span<const CaseToRun> cases) {
    return cases.front().number % 2 == 0 ? results_of(cases) : std::vector<CaseResult>{};
  };
  Delivered delivered;
  run_in_threads(2, each(run), piles(10), delivered.taker(), never);
  EXPECT_EQ(delivered.numbers, (std::multiset<std::uint64_t>{0, 2, 4, 6, 8}));
}

}  // namespace threads_test
}  // namespace lk::emulator

// The least that still fails is a case of the plan, and one that cannot be had costs no report.

#include "tools/campaign/run/smallest.hpp"

#include <gtest/gtest.h>

#include "tests/tools/campaign/run/run_support.hpp"

namespace lk::test {
namespace smallest_test {

using emulator::CaseResult;
using emulator::CaseValue;
using emulator::OfflineRunner;
using emulator::Plan;

constexpr const char* kJams =
    "fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = 1\nfault.jam.percent = [85, 90, 95, 100]\n";

Plan jams(const std::string& exclude = "") {
  return plan_of("joint_moves", kJams, "sampling = \"full\"\n" + exclude);
}

/// The case of 100 %.
CaseResult worst(const Plan& plan) { return OfflineRunner(plan).run(cases_of(plan, {3})).at(0); }

double percent_of_smallest(const Plan& plan) {
  OfflineRunner runner(plan);
  return std::get<double>(*shrunk(plan, runner, worst(plan)).values.at(3));
}

TEST(Smallest, IsNoneThatThePlanExcludes) {
  const double least = percent_of_smallest(jams());
  ASSERT_LT(least, 100);
  const double other = percent_of_smallest(
      jams("[[exclude]]\nfault.jam.percent = " + emulator::value_text(least) + "\n"));
  EXPECT_GT(other, least);
}

TEST(Smallest, LeavesOutWhatCannotBeHad) {
  const Plan plan = jams();
  emulator::Answer answer;
  answer.head = plan.head;
  answer.plan_file = "p.toml";
  answer.residual = {worst(plan), worst(plan)};
  answer.residual[0].outcome = emulator::CaseOutcome::kLate;
  answer.residual[1].outcome = emulator::CaseOutcome::kSilentlyWrong;
  answer.residual[0].values.at(1) = CaseValue(9.0);  // no drive of this robot
  const auto smallest = smallest_cases(plan, answer, 2, [] { return false; });
  ASSERT_EQ(smallest.size(), 1);
  EXPECT_EQ(smallest[0].outcome, emulator::CaseOutcome::kSilentlyWrong);
  EXPECT_NE(smallest[0].svg, "");
}

}  // namespace smallest_test
}  // namespace lk::test

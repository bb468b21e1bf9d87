#include "emulator/core/bus/agenda.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

namespace lk::emulator {
namespace agenda_test {

/// A task that `number` identifies.
Task task(int number) { return Reconnect{number}; }

std::vector<int> all_of(Agenda agenda) {
  std::vector<int> order;
  while (agenda.next_due()) order.push_back(std::get<Reconnect>(agenda.take()).id);
  return order;
}

TEST(Agenda, IsInTheOrderOfTimesAndThenOfEntering) {
  std::mt19937 random(1);
  Agenda agenda;
  std::vector<std::pair<int, int>> entered;
  for (int n = 0; n < 500; ++n) {
    const int at = static_cast<int>(random() % 20);
    agenda.schedule(SimTime(at), task(n));
    entered.emplace_back(at, n);
  }
  std::ranges::stable_sort(entered, {}, &std::pair<int, int>::first);
  std::vector<int> expected;
  for (const auto& [at, n] : entered) expected.push_back(n);
  EXPECT_EQ(all_of(agenda), expected);
  agenda.cancel<Reconnect>(expected[100]);
  expected.erase(expected.begin() + 100);
  EXPECT_EQ(all_of(agenda), expected) << "what is left keeps its order";
}

TEST(Agenda, CountsAndForgetsDirectivesAlone) {
  Agenda agenda;
  agenda.schedule(SimTime(2), task(1));
  agenda.schedule(SimTime(1), Directive{1, PowerOff{}});
  agenda.schedule(SimTime(3), Directive{1, PowerOn{}});
  EXPECT_EQ(agenda.directives(), 2U);
  agenda.cancel_directives();
  EXPECT_EQ(agenda.directives(), 0U);
  EXPECT_EQ(all_of(agenda), std::vector<int>{1});
}

}  // namespace agenda_test
}  // namespace lk::emulator

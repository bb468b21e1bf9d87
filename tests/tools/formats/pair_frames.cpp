// Pairs frames of drives 1 to 4 by log_pairing, for a test in Python. Reads lines "0.000338
// 141#9A1900F000000000"; writes for each the number of its query, 0 for a query, "orphan" for a
// reply without a query.

#include <cstdio>
#include <exception>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "emulator/monitor/frames/log_pairing.hpp"
#include "tests/support/frames.hpp"

namespace {

using namespace lk::emulator;

BusConfig four_drives() {
  BusConfig bus;
  for (int id = 1; id <= 4; ++id) {
    ServoConfig servo;
    servo.id = id;
    bus.servos.push_back(servo);
  }
  return bus;
}

/// Times are unique and identify the frames.
void print_pairs(const std::vector<LoggedFrame>& log, const PairedLog& paired) {
  constexpr int kOrphan = -1;
  std::map<SimTime, int> answers;
  std::map<SimTime, int> numbers;
  for (const LoggedFrame& one : log) {
    numbers[one.timed.at] = static_cast<int>(numbers.size()) + 1;
    answers[one.timed.at] = kOrphan;
  }
  for (const TimedFrame& query : paired.sent) answers[query.at] = 0;
  for (const Exchange& exchange : paired.exchanges) {
    if (exchange.reply) answers[exchange.reply->at] = numbers.at(paired.sent[exchange.query].at);
  }
  for (const auto& [at, number] : answers) {
    if (number == kOrphan) {
      std::cout << "orphan\n";
    } else {
      std::cout << number << '\n';
    }
  }
}

}  // namespace

int main() {
  try {
    std::vector<LoggedFrame> log;
    for (std::string line; std::getline(std::cin, line);) {
      std::istringstream words(line);
      double at_s = 0;
      std::string text;
      words >> at_s >> text;
      const auto at = std::chrono::round<SimTime>(std::chrono::duration<double>(at_s));
      log.push_back({{at, lk::test::frame(text)}, std::nullopt});
    }
    print_pairs(log, pair_log(log, four_drives()));
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "pair_frames: %s\n", problem.what());
    return 1;
  }
  return 0;
}

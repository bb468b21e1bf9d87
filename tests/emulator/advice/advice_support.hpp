#pragma once

/// @file A host on a bus, with an adviser.

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/monitor/advice/adviser.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {

using namespace std::chrono_literals;
using protocol::encode_query;

/// Returns a query for a drive of the tests' default generation, or another.
inline protocol::Frame query(const protocol::Command& command, int id = 1,
                             Generation generation = Generation::kLegacy) {
  return encode_query(id, command,
                      protocol::wire_format(quirks_of(generation).dialect, Series::kMg));
}

class AdvisedHost {
 public:
  explicit AdvisedHost(const BusConfig& config) : bus(config), adviser(config) {
    adviser.observe(bus);
  }
  explicit AdvisedHost(const ServoConfig& servo, std::int64_t bitrate = 1'000'000)
      : AdvisedHost(with(servo, bitrate)) {}

  void send(const protocol::Frame& frame) {
    const TimedFrame in{bus.time(), frame};
    adviser.on_query(in);
    bus.receive(in);
  }
  void send(std::string_view frame) { send(test::frame(frame)); }
  /// The adviser receives a frame at `at`, without a bus.
  void receive(SimTime at, const protocol::Frame& frame) { adviser.on_query({at, frame}); }
  void receive(SimTime at, std::string_view frame) { receive(at, test::frame(frame)); }
  /// As above, `times` frames.
  void receive(int times, SimTime from, SimTime period, const protocol::Frame& frame) {
    for (int n = 0; n < times; ++n) receive(from + n * period, frame);
  }
  void wait(SimTime duration) {
    const SimTime end = bus.time() + duration;
    while (bus.time() < end) {
      bus.advance_to(std::min(end, bus.time() + Adviser::kObservePeriod));
      if (adviser_receives_replies) hear_replies();
      adviser.observe(bus);
    }
  }
  /// Sends the frame `times` times, with a wait of `gap` after each.
  void repeat(int times, SimTime gap, const protocol::Frame& frame) {
    for (int n = 0; n < times; ++n) {
      send(frame);
      wait(gap);
    }
  }
  void repeat(int times, SimTime gap, std::string_view frame) {
    repeat(times, gap, test::frame(frame));
  }

  /// Returns the count over all causes.
  std::uint64_t count(AdviceKind kind, int id = 1) const {
    std::uint64_t sum = 0;
    for (const Advice& advice : adviser.advice()) {
      if (advice.found.kind == kind && advice.id == id) sum += advice.count;
    }
    return sum;
  }
  /// Returns the first advice of the kind. Pre: there is one.
  Advice get(AdviceKind kind, int id = 1) const {
    for (const Advice& advice : adviser.advice()) {
      if (advice.found.kind == kind && advice.id == id) return advice;
    }
    throw std::logic_error("no such advice");
  }
  /// Returns the problem, in English, of the first advice of the kind. Pre: there is one.
  std::string what(AdviceKind kind, int id = 1) const {
    return what_text(get(kind, id), Language::kEnglish);
  }
  /// Returns all kinds of advice, for a message.
  std::string all() const {
    std::string text;
    for (const Advice& advice : adviser.advice()) {
      text += advice_line("bus", advice, Language::kEnglish) + '\n';
    }
    return text;
  }

  Bus bus;
  Adviser adviser;
  bool adviser_receives_replies = false;  // as in the program; else replies stay on the bus

 private:
  void hear_replies() {
    std::vector<TimedFrame> replies;
    bus.take_replies(replies);
    for (const TimedFrame& reply : replies) adviser.on_reply(reply);
  }
  static BusConfig with(const ServoConfig& servo, std::int64_t bitrate) {
    BusConfig config = test::bus_config({}, bitrate);
    config.servos.push_back(servo);
    return config;
  }
};

/// As AdvisedHost, but its adviser receives replies too.
class AnsweredHost : public AdvisedHost {
 public:
  template <class Config>
  explicit AnsweredHost(const Config& config) : AdvisedHost(config) {
    adviser_receives_replies = true;
  }
};

}  // namespace lk::emulator

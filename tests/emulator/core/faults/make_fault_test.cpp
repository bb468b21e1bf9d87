// Faults and directives as written in C++ tests, and their mistakes.

#include "emulator/core/faults/make_fault.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace make_fault_test {

using namespace std::chrono_literals;

/// Returns the message of the refusal, or an empty string.
std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return "";
}

std::string refusal_of(std::string_view kind, const std::vector<FaultSetting>& settings = {},
                       const std::vector<int>& ids = {1}) {
  return refusal([&] { make_fault(kind, settings, ids); });
}

TEST(MakeFault, TakesKindParametersAndDrivesByName) {
  const Fault jam = make_fault("jam", {{"percent", 60}}, {3, 1});
  EXPECT_EQ(jam.row, find_fault("jam"));
  EXPECT_EQ(jam.values[0].number(), 60);
  EXPECT_EQ(jam.ids, (std::vector{1, 3}));

  const Fault offset = make_fault("current_offset", {{"channel", "both"}, {"offset_A", -0.5}}, {1});
  EXPECT_EQ(offset.values[0].number(), -0.5);
  EXPECT_EQ(offset.values[1].choice(), FaultChoice{2});

  EXPECT_EQ(make_fault("jam", {}, {1}).values[0].number(), 100) << "the default";
  EXPECT_TRUE(make_fault("echo").ids.empty());
}

TEST(MakeFault, RefusesMistakesWithAMessage) {
  EXPECT_EQ(refusal_of("jan"), "fault 'jan': unknown kind; did you mean jam?");
  EXPECT_EQ(refusal_of("no such thing"),
            "fault 'no such thing': unknown kind; lk-emu faults lists them");
  EXPECT_EQ(refusal_of("jam", {{"percnt", 60}}),
            "fault 'jam': no parameter 'percnt'; it takes: percent");
  EXPECT_EQ(refusal_of("cut", {{"to_V", 0}}), "fault 'cut': no parameter 'to_V'; it takes none");
  EXPECT_EQ(refusal_of("jam", {{"percent", 160}}),
            "fault 'jam': percent is 160; allowed: 0 to 100");
  EXPECT_EQ(refusal_of("jam", {{"percent", std::numeric_limits<double>::quiet_NaN()}}),
            "fault 'jam': percent is nan; allowed: 0 to 100");
  EXPECT_EQ(refusal_of("jam", {{"percent", "much"}}),
            "fault 'jam': percent is 'much'; allowed: 0 to 100");
  EXPECT_EQ(refusal_of("wrong_dlc", {{"dlc", 1.5}}),
            "fault 'wrong_dlc': dlc is 1.5; allowed: 0 to 7, whole numbers");
  EXPECT_EQ(refusal_of("drop", {{"frames", "all"}}),
            "fault 'drop': frames is 'all'; one of: replies, queries, both");
  EXPECT_EQ(refusal_of("drop", {{"frames", 1}}),
            "fault 'drop': frames is 1; one of: replies, queries, both");
  EXPECT_EQ(refusal_of("sag"), "fault 'sag': to_V is missing; allowed: 0 to 100");
  EXPECT_EQ(refusal_of("end_stop"), "fault 'end_stop': min_deg or max_deg is missing");
  EXPECT_EQ(refusal_of("jam", {}, {}),
            "fault 'jam': no drives; name the IDs of those that have it");
  EXPECT_EQ(refusal_of("jam", {}, {1, 1}), "fault 'jam': the IDs must ascend, each once");
  EXPECT_EQ(refusal_of("echo"), "fault 'echo': belongs to the bus as a whole; leave the IDs out");
}

class BusMistakes : public testing::Test {
 protected:
  std::string refusal_of(const Directive& directive) {
    const std::string planned = refusal([&] { bus.plan({1s, directive}); });
    EXPECT_EQ(refusal([&] { bus.apply(directive); }), planned);
    BusConfig config = test::bus_config({1, 3});
    config.events.push_back({1s, directive});
    EXPECT_EQ(refusal([&] { Bus other(config); }), planned);
    return planned;
  }
  std::string refusal_of(const Fault& fault) {
    return refusal_of(Directive{kWholeBus, SetFault{fault}});
  }

  Bus bus{test::bus_config({1, 3})};
};

TEST_F(BusMistakes, FaultsWithWrongValuesAreRefused) {
  EXPECT_EQ(refusal_of(Fault{}), "a fault without a kind; make it with make_fault");
  EXPECT_EQ(refusal_of(make_fault("jam", {}, {1, 2})), "drive 2: not on this bus");
  Fault fault = make_fault("drop", {}, {1});
  fault.values[0] = 1.0;
  EXPECT_EQ(refusal_of(fault),
            "fault 'drop': wrong value of frames; one of: replies, queries, both");
  fault = make_fault("delay", {{"delay_ms", 1}}, {1});
  fault.values[0] = 1e30;
  EXPECT_EQ(refusal_of(fault), "fault 'delay': wrong value of delay_ms; allowed: 0 to 10000");
  fault = make_fault("jam", {}, {1, 3});
  fault.ids = {3, 1};
  EXPECT_EQ(refusal_of(fault), "fault 'jam': the IDs must ascend, each once");
  fault = make_fault("jam", {}, {1});
  fault.every = 1s;
  EXPECT_EQ(refusal_of(fault), "fault 'jam': every needs a duration");
  fault.duration = 1s;
  EXPECT_EQ(refusal_of(fault), "fault 'jam': every must be longer than duration");
  fault.duration = 0s;
  const char* const kDuration = "fault 'jam': duration must be above 0 s, and at most 100000000 s";
  EXPECT_EQ(refusal_of(fault), kDuration);
  fault.duration = SimTime::max();
  EXPECT_EQ(refusal_of(fault), kDuration);
  fault.duration.reset();
  fault = make_fault("reset", {}, {1});
  for (const SimTime every : {SimTime{1}, SimTime::max()}) {
    fault.every = every;
    EXPECT_EQ(refusal_of(fault),
              "fault 'reset': every must be at least 0.001 s, and at most 100000000 s");
  }
  fault = make_fault("wrong_dlc", {{"dlc", 1}}, {1});
  fault.values[0] = 1.5;
  EXPECT_EQ(refusal_of(fault),
            "fault 'wrong_dlc': wrong value of dlc; allowed: 0 to 7, whole numbers");
  fault = make_fault("reset", {}, {1});
  fault.duration = 1s;
  EXPECT_EQ(refusal_of(fault), "fault 'reset': is instantaneous; remove the duration");
  fault = make_fault("drop", {}, {1});
  fault.probability = -1;
  EXPECT_EQ(refusal_of(fault), "fault 'drop': probability is -1; allowed: 0 to 1");
  EXPECT_TRUE(bus.faults().empty());
}

TEST_F(BusMistakes, AbsentDrivesAreRefused) {
  const std::string absent = "drive 2: not on this bus";
  EXPECT_EQ(refusal_of(Directive{2, PowerOff{}}), absent);
  EXPECT_EQ(refusal_of(Directive{2, PowerCycle{}}), absent);
  EXPECT_EQ(refusal_of(Directive{2, SupplyVoltage{12}}), absent);
  EXPECT_EQ(refusal_of(Directive{2, Setting{}}), absent);
  EXPECT_EQ(refusal_of(Directive{-1, PowerOn{}}), "drive -1: not on this bus");
  EXPECT_EQ(refusal_of(Directive{kWholeBus, PowerOn{}}), "drive 0: not on this bus");
  EXPECT_EQ(refusal([&] {
              bus.plan({1s, {1, PowerOff{}}, Condition{2, CommandSeen{0x9C}}});
            }),
            absent);
  EXPECT_EQ(refusal([&] { bus.truth(2); }), absent);
  EXPECT_EQ(refusal([&] { bus.telemetry(33); }), "drive 33: not on this bus");
  EXPECT_EQ(bus.state().agenda.directives(), 0U);
}

TEST_F(BusMistakes, InvalidIdsAreRefused) {
  const auto refusal_with = [](int first, int second) {
    BusConfig config;
    config.servos.resize(2);
    config.servos[0].id = first;
    config.servos[1].id = second;
    return refusal([&] { Bus other(config); });
  };
  EXPECT_EQ(refusal_with(1, 1), "drive 1 follows drive 1: the IDs of a bus must ascend, each once");
  EXPECT_EQ(refusal_with(2, 1), "drive 1 follows drive 2: the IDs of a bus must ascend, each once");
  EXPECT_EQ(refusal_with(1, 33), "drive 33: IDs are 1 to 32");
  EXPECT_EQ(refusal_with(0, 1), "drive 0: IDs are 1 to 32");
}

}  // namespace make_fault_test
}  // namespace lk::emulator

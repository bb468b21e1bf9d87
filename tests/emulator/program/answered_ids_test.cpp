// Drives whose ROM contains another ID, which another program may answer for.

#include "emulator/io/program/answered_ids.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "emulator/core/start_error.hpp"
#include "tests/support/id_lock.hpp"
#include "tests/support/log.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace answered_ids_test {

/// A name unique to this process, because the network namespace is shared.
std::string name() { return "a" + std::to_string(::getpid()); }

BusConfig one_drive(int id, std::uint8_t in_rom) {
  BusConfig config = test::bus_config({});
  config.interface = name();
  config.servos = {test::drive(Generation::kV236b, Series::kMg, id)};
  config.servos[0].rom.driver_id = in_rom;
  return config;
}

std::string problem_at_start(const BusConfig& config) {
  AnsweredIds ids;
  try {
    ids.take(config, {});
    ids.start(Line(config));
    return "";
  } catch (const StartError& problem) {
    return problem.what();
  }
}

TEST(AnsweredIds, SuggestWipingRomForAConflictingId) {
  const Descriptor other = test::id_lock(name(), 9);
  EXPECT_TRUE(problem_at_start(one_drive(9, 9)).ends_with("; stop it, or give other --ids"))
      << problem_at_start(one_drive(9, 9));
  EXPECT_TRUE(
      problem_at_start(one_drive(3, 9))
          .ends_with("; stop it, or start with --wipe-rom: drive 3 has this ID from its ROM"))
      << problem_at_start(one_drive(3, 9));
  EXPECT_EQ(problem_at_start(one_drive(3, 4)), "");
}

TEST(AnsweredIds, LogEachConflictOnce) {
  const test::Log log;
  const auto times = [&] {
    std::size_t found = 0;
    for (std::size_t at = 0;
         (at = log.text().find("until then both answer", at)) != std::string::npos; ++at) {
      ++found;
    }
    return found;
  };
  const Descriptor other = test::id_lock(name(), 9);
  const BusConfig config = one_drive(3, 3);
  Line line(config);
  AnsweredIds ids;
  ids.take(config, {});
  ids.start(line);
  const auto move_to = [&](const char* query) {
    line.accept({line.bus().time(), test::frame(query)});
    line.advance_to(line.bus().time() + std::chrono::seconds(1), MonoTime::max(),
                    Line::WaitPolicy::kNone);
    ids.update(line);
  };
  // 0x42 sets the ID, 0x44 saves, 0x07 restarts with it (docs/reference/protocol.md §10.9).
  for (const char* query :
       {"143#42050A0009000000", "143#4405FA0000000000", "143#0700000000000000"}) {
    move_to(query);
  }
  EXPECT_EQ(line.bus().bus_address(3).id, 9);
  EXPECT_EQ(times(), 1U) << log.text();
  ids.update(line);
  EXPECT_EQ(times(), 1U) << "said already";
  for (const char* query :
       {"149#42050A0003000000", "149#4405FA0000000000", "149#0700000000000000",
        "143#42050A0009000000", "143#4405FA0000000000", "143#0700000000000000"}) {
    move_to(query);
  }
  EXPECT_EQ(line.bus().bus_address(3).id, 9);
  EXPECT_EQ(times(), 2U) << log.text();
}

}  // namespace answered_ids_test
}  // namespace lk::emulator

// Every kind of bus, with a host that finds it as hosts do.

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <set>

#include "emulator/ground/start_error.hpp"
#include "tests/tools/campaign/hosts/hosts_support.hpp"
#include "tools/campaign/hosts/host_bus.hpp"

namespace lk::emulator::hosts_test {
namespace {

constexpr const char* kHost = LKEMU_SOURCE_DIR "/tests/tools/campaign/hosts/bus_host.py";

class HostBuses : public testing::TestWithParam<const char*> {};

TEST_P(HostBuses, AHostGetsAReply) {
  HostSetup setup = host({"/usr/bin/python3", "-B", kHost}, GetParam());
  check_host(setup);
  const HostRun done = run(setup, quiet_case());
  EXPECT_EQ(done.status, 0);
  EXPECT_EQ(done.output, "answered\n");
  EXPECT_GE(done.verdict.replies, 1U);
}

INSTANTIATE_TEST_SUITE_P(WithoutCan, HostBuses,
                         testing::Values("slcan-tcp", "slcan-pty", "socketcand", "udp-multicast",
                                         "rs485", "rs485-tcp"));

/// In a network of its own, where the kernel has vcan; else one line says what to do.
TEST(HostBuses, OnVcanEachCaseHasItsOwn) {
  HostSetup setup = host({"/usr/bin/python3", "-B", kHost}, "vcan");
  try {
    check_host(setup);
  } catch (const StartError& problem) {
    const std::string why = problem.what();
    EXPECT_TRUE(why.starts_with("host: bus: ")) << why;
    EXPECT_TRUE(
        why.ends_with("; run the campaign under scripts/with-vcan, or say bus = \"slcan-tcp\""))
        << why;
    EXPECT_EQ(std::getenv("LKEMU_NEEDS_VCAN"), nullptr) << why;
    return;
  }
  std::uint64_t given = 0;
  int answered = 0;
  run_host_cases(
      setup, 3,
      [&]() -> std::optional<HostCase> {
        return given < 3 ? std::optional(quiet_case(given++)) : std::nullopt;
      },
      [&](const HostCase& /*one*/, const HostRun& run) {
        EXPECT_EQ(run.output, "answered\n");
        ++answered;
      });
  EXPECT_EQ(answered, 3);
}

/// Whoever asks the system for any port does not get one that is kept.
TEST(HostBuses, PortsAreKept) {
  const test::TempDirectory own;
  std::set<std::string> ports;
  std::vector<std::unique_ptr<HostBus>> buses;
  for (int n = 0; n < 100; ++n) {
    buses.push_back(std::make_unique<HostBus>("slcan-tcp", own.path()));
    ports.insert(buses.back()->port());
  }
  EXPECT_EQ(ports.size(), 100U);
}

}  // namespace
}  // namespace lk::emulator::hosts_test

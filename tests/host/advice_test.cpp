// Advice about a host: its outputs, and the effect of --strict.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/host/control_client.hpp"
#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace advice_test {

class Advice : public testing::Test {
 protected:
  std::string socket() const { return own_.path("s"); }
  std::vector<std::string> arguments(std::vector<std::string> more) const {
    more.insert(more.begin(), {"--rom", ":memory:", "--bus", own_bus(), "--ids", "1", "--quirk",
                               "off_needs_run=true", "--control", socket()});
    return more;
  }
  double simulated_s() const { return ask(socket(), "GET /clock").number("time_s"); }
  /// Switches the drive off and commands motion, after all parts of a host could have noticed.
  void err(Host& host) const {
    EXPECT_TRUE(host.query(1, {0x80}));
    for (const double off_s = simulated_s(); simulated_s() < off_s + 0.2;) {
    }
    EXPECT_TRUE(host.query(1, {0xA1, 0, 0, 0, 10}));
    EXPECT_TRUE(host.query(1, {0xA1, 0, 0, 0, 20}));
  }

  const test::TempDirectory own_;
};

TEST_F(Advice, AppearsInLogApiAndSummary) {
  StartedEmulator emulator(arguments({"--lang", "en"}));
  Host host(own_bus());
  err(host);
  EXPECT_TRUE(emulator.wait_for_log(own_bus() + ":1: motion-refused: the drive is off"));
  Answer answer = ask(socket(), "GET /advice");
  EXPECT_EQ(answer.status, 200);
  while (answer.number("count") == 1) answer = ask(socket(), "GET /advice");
  EXPECT_EQ(answer.number("count"), 2);
  EXPECT_EQ(answer.number("drive"), 1);
  EXPECT_NE(answer.body.find("141#A10000000A000000"), std::string::npos) << answer.body;
  EmulatorProcess ctl({"ctl", "--socket", socket(), "advice", "--lang", "zh"});
  const auto shown = ctl.wait();
  EXPECT_EQ(shown.status, 0) << shown.err;
  EXPECT_NE(shown.out.find(own_bus() + ":1  motion-refused  2 x"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("驱动器已关闭"), std::string::npos) << shown.out;
  const auto end = emulator.stop();
  EXPECT_EQ(end.status, 0) << "it is told, no more";
  EXPECT_NE(end.err.find("advice about the host:\n  " + own_bus() + ":1: motion-refused"),
            std::string::npos)
      << end.err;
}

TEST_F(Advice, FailsTheRunWithStrict) {
  StartedEmulator emulator(arguments({"--strict", "--lang", "zh"}));
  Host host(own_bus());
  err(host);
  EXPECT_TRUE(emulator.wait_for_log("motion-refused"));
  const auto end = emulator.stop();
  EXPECT_EQ(end.status, 1) << end.err;
  EXPECT_NE(end.err.find("对主机的建议"), std::string::npos) << end.err;
}

TEST_F(Advice, IgnoresHostThatWaitsForReplies) {
  StartedEmulator emulator(arguments({"--strict"}));
  Host host(own_bus());
  EXPECT_TRUE(host.query(1, {0x9B}));
  EXPECT_TRUE(host.query(1, {0x88}));
  for (std::uint8_t n = 0; n < 200; ++n) {
    EXPECT_TRUE(host.query(1, {0xA1, 0, 0, 0, static_cast<std::uint8_t>(n / 4)}));
    EXPECT_TRUE(host.query(1, {0x92}));
  }
  EXPECT_TRUE(host.query(1, {0x9A}));
  EXPECT_TRUE(host.query(1, {0x80}));
  const auto end = emulator.stop();
  EXPECT_EQ(end.status, 0) << end.err;
}

}  // namespace advice_test
}  // namespace lk::host

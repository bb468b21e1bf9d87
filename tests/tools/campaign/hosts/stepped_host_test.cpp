// Hosts that move the clock: fast, and the same to the bit.

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "tests/tools/campaign/hosts/hosts_support.hpp"

namespace lk::emulator::hosts_test {
namespace {

/// A joint that is jammed half-way to 90 degrees: at 180 °/s it is there 0.25 s after its start,
/// and something holds it from then on.
class SteppedHost : public testing::Test {
 protected:
  SteppedHost() {
    robot_ =
        own_.put("robot.toml",
                 "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\nboot_angle_deg = 0\n");
  }
  HostCase joint_case(bool jammed, std::uint64_t number = 0) const {
    HostCase one;
    one.number = number;
    one.robot = robot_;
    one.seed = 1 + number;
    one.scenario_toml =
        "duration_s = 3\n[[expect]]\nsays = \"the joint has been at 90 degrees\"\nid = 1\n"
        "signal = \"true_angle_deg\"\nmin = 89\nmax = 91\nby_s = 3\n";
    if (jammed) {
      one.scenario_toml +=
          "[[event]]\nid = 1\nwhen = { signal = \"angle_deg\", crosses = 45 }\n"
          "fault = { kind = \"jam\", percent = 100 }\n";
    }
    return one;
  }
  static HostSetup stepped(std::vector<std::string> command) {
    HostSetup setup = host(std::move(command));
    setup.stepped = true;
    setup.detecting_exit_status = {3};
    setup.detecting_lines = {"^error: "};
    return setup;
  }
  static HostSetup python() {
    ::setenv("PYTHONPATH", LKEMU_SOURCE_DIR "/python", 1);
    return stepped(
        {"/usr/bin/python3", "-B", LKEMU_SOURCE_DIR "/python/examples/joint_host.py", "90", "0"});
  }

  test::TempDirectory own_;
  std::string robot_;
};

TEST_F(SteppedHost, ASampleControllerInPythonArrives) {
  const HostRun done = run(python(), joint_case(false));
  EXPECT_EQ(done.status, 0) << done.output;
  EXPECT_TRUE(done.notices.empty());
  EXPECT_EQ(done.verdict.outcome, "passed");
  EXPECT_TRUE(done.output.ends_with("0 retries, 1 homings\n")) << done.output;
}

TEST_F(SteppedHost, ASampleControllerInPythonNoticesThatItIsStuck) {
  const HostRun done = run(python(), joint_case(true));
  EXPECT_EQ(done.status, 3) << done.output;
  ASSERT_FALSE(done.notices.empty());
  EXPECT_TRUE(done.notices[0].text.starts_with("error: Stalled: stuck at 4"))
      << done.notices[0].text;
  ASSERT_EQ(done.verdict.faults.size(), 1U);
  const HostFault& jam = done.verdict.faults[0];
  EXPECT_EQ(jam.kind, "jam");
  EXPECT_GT(jam.effects, 0U);
  // Its limit is 0.3 s without progress; a poll has the pause of 5 ms and two replies of at most
  // 1 ms, and there may be one more before the stop, which is answered.
  const SimTime took = done.notices[0].at - jam.began_at.value();
  EXPECT_GT(took, 300ms);
  EXPECT_LE(took, 300ms + 2 * 7ms + 1ms);
  // The rest of the scenario was run without it.
  EXPECT_EQ(done.verdict.outcome, "failed");
  EXPECT_EQ(done.verdict.expectations.at(0).decided_at, 3s);
}

TEST_F(SteppedHost, TheSameCaseGivesTheSameEveryTime) {
  const HostSetup setup = python();
  const HostRun first = run(setup, joint_case(true));
  for (int n = 0; n < 4; ++n) {
    const HostRun again = run(setup, joint_case(true));
    EXPECT_TRUE(same(again, first)) << again.output << again.verdict.replies_hash;
  }
  EXPECT_FALSE(same(run(setup, joint_case(false)), first));
}

TEST_F(SteppedHost, ASampleControllerInCpp) {
  const HostSetup setup = stepped({LKEMU_JOINT_HOST});
  const HostRun well = run(setup, joint_case(false));
  EXPECT_EQ(well.output, "at 90 degrees\nat 0 degrees\n");
  EXPECT_EQ(well.verdict.outcome, "passed");
  const HostRun jammed = run(setup, joint_case(true));
  ASSERT_FALSE(jammed.notices.empty());
  EXPECT_EQ(jammed.notices[0].text, "error: not at 90 degrees");
  // 0.2 s for the boot, 2 s of patience, and what passes while it waits for each of 200 replies.
  EXPECT_GE(jammed.notices[0].at, 2200ms);
  EXPECT_LE(jammed.notices[0].at, 2200ms + 205 * 1ms);
}

/// Whatever else runs on the machine.
TEST_F(SteppedHost, EightAtOnceGiveWhatEachGivesAlone) {
  const HostSetup setup = stepped({LKEMU_JOINT_HOST});
  std::map<std::uint64_t, HostRun> together;
  std::uint64_t given = 0;
  run_host_cases(
      setup, 8,
      [&]() -> std::optional<HostCase> {
        if (given == 16) return std::nullopt;
        const std::uint64_t number = given++;
        return joint_case(number % 2 == 1, number);
      },
      [&](const HostCase& one, const HostRun& run) { together[one.number] = run; });
  ASSERT_EQ(together.size(), 16U);
  for (const auto& [number, done] : together) {
    EXPECT_TRUE(same(done, run(setup, joint_case(number % 2 == 1, number)))) << number;
  }
}

/// A line is of the instant at which time stood when it was printed, however late it is read.
TEST_F(SteppedHost, ALineIsOfItsInstant) {
  const test::TempDirectory own;
  const std::string script = own.put("host.py", R"(
import lkemu
attached = lkemu.attach()
attached.sleep(0.25)
print("error: now")
attached.sleep(1)
)");
  python();
  HostSetup setup = stepped({"/usr/bin/python3", "-B", script});
  const HostRun done = run(setup, joint_case(false));
  ASSERT_FALSE(done.notices.empty()) << done.output;
  EXPECT_EQ(done.notices[0].at, 250ms);
  EXPECT_EQ(done.ended_at, 1250ms);
}

/// In real time the same programs need no change. What they notice depends on the machine.
TEST_F(SteppedHost, TheSameHostsInRealTime) {
  HostSetup setup = python();
  setup.stepped = false;
  const HostRun in_python = run(setup, joint_case(false));
  EXPECT_EQ(in_python.end, HostRun::End::kExit);
  EXPECT_GT(in_python.verdict.replies, 0U) << in_python.output;
  HostSetup other = stepped({LKEMU_JOINT_HOST});
  other.stepped = false;
  const HostRun in_cpp = run(other, joint_case(false));
  EXPECT_EQ(in_cpp.end, HostRun::End::kExit);
  EXPECT_GT(in_cpp.verdict.replies, 0U) << in_cpp.output;
}

/// A machine that stands for a while: what came late then is not to be held against the host.
TEST_F(SteppedHost, InRealTimeItIsToldWhenTimeSlipped) {
  const std::string script = own_.put("host.py", R"py(
import os, signal, time
for pid in filter(str.isdigit, os.listdir("/proc")):
    try:
        with open(f"/proc/{pid}/stat") as file:
            parent = int(file.read().rsplit(")", 1)[1].split()[1])
    except OSError:  # it has just ended
        continue
    if parent == os.getppid() and int(pid) != os.getpid():
        os.kill(int(pid), signal.SIGSTOP)
        time.sleep(0.3)
        os.kill(int(pid), signal.SIGCONT)
)py");
  const HostSetup setup = host({"/usr/bin/python3", "-B", script});
  const HostRun done = run(setup, joint_case(false));
  EXPECT_EQ(done.status, 0) << done.output;
  EXPECT_GT(done.slipped_s, 0.1);  // all but 50 ms
}

/// The drive's own protections, and the frames of the scenario beside those of the host.
TEST_F(SteppedHost, TellsWhenTheDriveHasNoticed) {
  HostCase one;
  one.robot = LKEMU_SOURCE_DIR "/configs/scenarios/robots/joint.toml";
  std::stringstream text;
  text << std::ifstream(LKEMU_SOURCE_DIR "/configs/scenarios/jammed_joint.toml").rdbuf();
  one.scenario_toml = text.str();
  const HostRun done = run(stepped({"true"}), one);
  EXPECT_EQ(done.ended_at, 0s);
  EXPECT_EQ(done.verdict.outcome, "passed");
  ASSERT_EQ(done.verdict.errors.size(), 1U);
  EXPECT_EQ(done.verdict.errors[0].error, "stall");
  // The jam begins at 1 s, and the protection waits for 0.3 s.
  EXPECT_GT(done.verdict.errors[0].at, 1300ms);
  EXPECT_LT(done.verdict.errors[0].at, 2500ms);
  ASSERT_EQ(done.verdict.faults.size(), 1U);
  EXPECT_EQ(done.verdict.faults[0].began_at, 1s);
  EXPECT_FALSE(done.verdict.replies_hash.empty());
}

}  // namespace
}  // namespace lk::emulator::hosts_test

// How hosts end, what they say, and that nothing is left of them.

#include "tools/campaign/hosts/run_host.hpp"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <cerrno>
#include <csignal>
#include <fstream>
#include <map>
#include <set>

#include "emulator/ground/start_error.hpp"
#include "tests/tools/campaign/hosts/hosts_support.hpp"
#include "tools/campaign/hosts/host_command.hpp"

namespace lk::emulator::hosts_test {
namespace {

std::string refusal(const HostSetup& setup) {
  try {
    check_host(setup);
  } catch (const StartError& problem) {
    return problem.what();
  }
  return "";
}

TEST(RunHost, IsCheckedWithTheSettingsOfACase) {
  const HostSetup setup = shell("echo {host.gain}");
  EXPECT_EQ(refusal(setup), "host: command: {host.gain} has no value: it is no dimension");
  HostCase one;
  one.host_values["gain"] = "0.5";
  EXPECT_NO_THROW(check_host(setup, one));
}

TEST(RunHost, AHostThatComesToItsEnd) {
  const HostRun done = run(shell("echo case {case}, gain {host.gain} on {bus}"), [] {
    HostCase one = quiet_case(4711);
    one.host_values["gain"] = "0.5";
    return one;
  }());
  EXPECT_EQ(done.end, HostRun::End::kExit);
  EXPECT_EQ(done.status, 0);
  EXPECT_FALSE(done.crashed(shell("")));
  EXPECT_TRUE(done.notices.empty());
  EXPECT_TRUE(done.output.starts_with("case 4711, gain 0.5 on slcan-tcp:")) << done.output;
  // It had ended long before the scenario, which has come to its end all the same.
  EXPECT_EQ(done.verdict.outcome, "passed");
  ASSERT_EQ(done.verdict.expectations.size(), 1U);
  EXPECT_TRUE(done.verdict.expectations[0].passed);
  EXPECT_EQ(done.verdict.expectations[0].says, "it stands");
  EXPECT_EQ(done.verdict.expectations[0].decided_at, 1s);
  // 10 °/s away from either end of a range that is 20 °/s wide.
  EXPECT_NEAR(done.verdict.expectations[0].margin.value(), 0.5, 0.1);
}

TEST(RunHost, NoticesByLinesThatTell) {
  HostSetup setup = shell("echo all is well; echo 'WARNING 7: no reply' >&2; echo WARNING 8");
  setup.detecting_lines = {"^error", "WARNING \\d+"};
  const HostRun done = run(setup, quiet_case());
  ASSERT_FALSE(done.notices.empty());
  EXPECT_EQ(done.notices[0].text, "WARNING 7: no reply");
  EXPECT_LE(done.notices[0].at, done.ended_at);
  EXPECT_EQ(done.notices[0].rule, 2U);
  ASSERT_EQ(done.notices.size(), 2U);
  EXPECT_EQ(done.notices[1].text, "WARNING 8");
  EXPECT_EQ(done.output, "all is well\nWARNING 7: no reply\nWARNING 8\n");
}

/// What differs in figures and paths alone is kept once, and no host makes more of them than many.
TEST(RunHost, KeepsOneNoticeOfEachGist) {
  HostSetup setup = shell(
      "echo 'at 0.1 s: slow'; echo 'at 0.2 s: slow'; echo '/tmp/a: slow'; echo lost; "
      "seq 5000 | tr 0-9 a-j; exit 3");
  setup.detecting_lines = {"."};
  setup.detecting_exit_status = {3};
  const HostRun done = run(setup, quiet_case());
  ASSERT_EQ(done.notices.size(), kMostNotices + 1);
  EXPECT_EQ(done.notices[0].text, "at 0.1 s: slow");
  EXPECT_EQ(done.notices[1].text, "/tmp/a: slow");
  EXPECT_EQ(done.notices[2].text, "lost");
  EXPECT_EQ(done.notices.back().text, "exit status 3");
}

TEST(RunHost, NoticesByItsExitStatus) {
  HostSetup setup = shell("exit 3");
  setup.detecting_exit_status = {2, 3};
  const HostRun done = run(setup, quiet_case());
  ASSERT_FALSE(done.notices.empty());
  EXPECT_EQ(done.notices[0].text, "exit status 3");
  EXPECT_EQ(done.notices[0].at, done.ended_at);
  EXPECT_FALSE(done.crashed(setup));
  setup.detecting_exit_status = {2};
  const HostRun other = run(setup, quiet_case());
  EXPECT_TRUE(other.notices.empty());
  EXPECT_TRUE(other.crashed(setup));
}

TEST(RunHost, ALineWithoutAnEndIsOneToo) {
  HostSetup setup = shell("printf 'no end of it'");
  setup.detecting_lines = {"end of it$"};
  EXPECT_EQ(run(setup, quiet_case()).notices.at(0).text, "no end of it");
}

/// Bounded, whatever it says; only the beginning of a line is searched.
TEST(RunHost, AHostThatSaysMuch) {
  HostSetup setup = shell("head -c 3000000 /dev/zero | tr '\\0' a; echo; echo found; seq 100000");
  setup.detecting_lines = {"^(a|b)*found", "^found"};
  const HostRun done = run(setup, quiet_case());
  EXPECT_EQ(done.notices.at(0).text, "found");
  EXPECT_EQ(done.output.size(), kLongestOutput);
  EXPECT_TRUE(done.output.ends_with("\n100000\n"));
}

TEST(RunHost, AHostThatHangsIsAResult) {
  HostSetup setup = shell("echo begun; exec tail -f /dev/null");
  setup.timeout_s = 0.2;
  const HostRun done = run(setup, quiet_case());
  EXPECT_EQ(done.end, HostRun::End::kTimeout);
  EXPECT_FALSE(done.crashed(setup));
  EXPECT_EQ(done.verdict.outcome, "passed");
}

TEST(RunHost, AHostThatDiesIsAResult) {
  const HostRun done = run(shell("kill -SEGV $$"), quiet_case());
  EXPECT_EQ(done.end, HostRun::End::kSignal);
  EXPECT_EQ(done.status, SIGSEGV);
  EXPECT_TRUE(done.crashed(shell("")));
  EXPECT_EQ(done.verdict.outcome, "passed");
}

/// In a session of its own, with the host's output open, deaf to what asks it to end.
TEST(RunHost, WhatAHostLeavesBehindEndsWithItsCase) {
  const test::TempDirectory own;
  const std::string fifo = own.path("pid");
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  const std::string stays =
      own.put("stays", "trap '' TERM HUP INT\necho $$ > " + fifo + "\nexec tail -f /dev/null\n");
  // The host ends when the other has said who it is.
  const HostRun done =
      run(shell("setsid sh " + stays + " & read pid < " + fifo + "; echo $pid"), quiet_case());
  EXPECT_EQ(done.end, HostRun::End::kExit);
  const int pid = std::stoi(done.output);
  EXPECT_EQ(::kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

TEST(RunHost, AHostThatCannotBeStartedIsUnusableInput) {
  EXPECT_EQ(refusal(host({"no-such-host", "--help"})),
            "host: command: there is no program no-such-host in PATH");
  EXPECT_EQ(refusal(host({"/no/such/host"})),
            "host: command: /no/such/host is no program that can be run");
  EXPECT_EQ(refusal(host({})), "host: command: says no program");
  EXPECT_THROW(run(host({"no-such-host"}), quiet_case()), StartError);
  // It is there, and what is to run it is not.
  const test::TempDirectory own;
  const std::string script = own.put("host", "#!/no/such/interpreter\n");
  ::chmod(script.c_str(), 0700);
  try {
    run(host({script}), quiet_case());
    ADD_FAILURE();
  } catch (const StartError& problem) {
    EXPECT_EQ(std::string(problem.what()),
              "host: command: " + script + " cannot be started: No such file or directory");
  }
}

TEST(RunHost, RefusesWhatCannotBe) {
  EXPECT_EQ(refusal(host({"true"}, "vcann")),
            "host: bus: \"vcann\" is not one of vcan, slcan-tcp, slcan-pty, socketcand, "
            "udp-multicast, rs485, rs485-tcp");
  HostSetup setup = host({"true"});
  setup.timeout_s = 0;
  EXPECT_EQ(refusal(setup), "host: timeout_s: must be above 0");
  setup = host({"true"});
  setup.detecting_lines = {"(open"};
  EXPECT_TRUE(refusal(setup).starts_with("host: says: \"(open\" is no regular expression"));
  EXPECT_EQ(refusal(host({"true"})), "");
  try {
    run(host({"echo", "{host.gain}"}), quiet_case());
    ADD_FAILURE();
  } catch (const StartError& problem) {
    EXPECT_EQ(std::string(problem.what()),
              "host: command: {host.gain} has no value: it is no dimension");
  }
}

/// What is wrong with a case is told with its number, as lk-emu tells it.
TEST(RunHost, SaysWhatIsWrongWithACase) {
  const auto problem_of = [](const HostCase& one) -> std::string {
    try {
      run(shell("true"), one);
    } catch (const StartError& problem) {
      return problem.what();
    }
    return "";
  };
  HostCase one = quiet_case(12);
  one.robot = "no-such-robot";
  EXPECT_TRUE(problem_of(one).starts_with("case 12: ")) << problem_of(one);
  EXPECT_NE(problem_of(one).find("no-such-robot"), std::string::npos) << problem_of(one);
  one = quiet_case(13);
  one.scenario_toml += "[[event]]\nat_s = 0\nid = 7\nfault = { kind = \"jam\" }\n";
  EXPECT_TRUE(problem_of(one).starts_with("case 13: file: ")) << problem_of(one);
  EXPECT_NE(problem_of(one).find("7"), std::string::npos) << problem_of(one);
}

TEST(RunHost, StopsWhenItIsToldTo) {
  const Descriptor stop(::eventfd(1, EFD_CLOEXEC));
  EXPECT_FALSE(run_host_case(shell("exec tail -f /dev/null"), quiet_case(), stop.get()));
}

TEST(RunHost, RunsManyAtOnce) {
  HostSetup setup = shell("echo $LKEMU_CASE on $LKEMU_BUS");
  std::uint64_t given = 0;
  std::map<std::uint64_t, HostRun> runs;
  run_host_cases(
      setup, 8,
      [&]() -> std::optional<HostCase> {
        return given < 16 ? std::optional(quiet_case(given++)) : std::nullopt;
      },
      [&](const HostCase& one, const HostRun& run) { runs[one.number] = run; });
  ASSERT_EQ(runs.size(), 16U);
  for (const auto& [number, done] : runs) {
    EXPECT_TRUE(done.output.starts_with(std::to_string(number) + " on slcan-tcp:")) << done.output;
    EXPECT_EQ(done.verdict.outcome, "passed");
  }
}

TEST(RunHost, OfManyTheFirstTroubleIsTold) {
  std::uint64_t given = 0;
  const auto next = [&]() -> std::optional<HostCase> {
    HostCase one = quiet_case(given++);
    if (one.number == 2) one.scenario_toml = "nonsense";
    return one;
  };
  EXPECT_THROW(run_host_cases(shell("true"), 2, next, [](const auto&, const auto&) {}), StartError);
}

/// However it ends: by SIGKILL it has no say in it.
TEST(RunHost, AKilledCampaignLeavesNothingBehind) {
  const test::TempDirectory own;
  const std::string fifo = own.path("pids");
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  // Its own, that of what it has started, and that of the process that keeps all of the case.
  const HostSetup setup = shell("setsid tail -f /dev/null & echo $$ $! $PPID > " + fifo + "; wait");
  const pid_t campaign = ::fork();
  if (campaign == 0) {
    ::setenv("TMPDIR", own.path().c_str(), 1);
    run_host_case(setup, quiet_case());
    ::_exit(0);
  }
  int host = 0, left = 0, keeper = 0;
  std::ifstream(fifo) >> host >> left >> keeper;
  const Watched processes[] = {Watched(host), Watched(left), Watched(keeper)};
  EXPECT_FALSE(processes[0].has_ended());
  ::kill(campaign, SIGKILL);
  ::waitpid(campaign, nullptr, 0);
  // The keeper ends when all of its own have, lk-emu too.
  for (const Watched& process : processes) EXPECT_TRUE(process.ends());
  EXPECT_EQ(own.names(), std::set<std::string>{"pids"});
}

}  // namespace
}  // namespace lk::emulator::hosts_test

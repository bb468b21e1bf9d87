// lk-emu run by the real program: exit statuses, output files, refusals. No bus is needed.

#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <sstream>

#include "tests/host/emulator_process.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace run_test {

namespace fs = std::filesystem;

/// A private directory with a robot.
class Run : public testing::Test {
 protected:
  Run() {
    put("robot.toml",
        "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"1-2\"\nmotor = \"mf7015\"\n"
        "generation = \"v235\"\n");
  }

  std::string path(const std::string& name) const { return own_.path(name); }
  std::string put(const std::string& name, const std::string& text) const {
    return own_.put(name, text);
  }
  std::string scenario(const std::string& name, const std::string& rest) const {
    return put(name, "robot = \"robot.toml\"\nduration_s = 1\n" + rest);
  }
  static EmulatorProcess::Exit run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "run");
    return EmulatorProcess(arguments).wait();
  }

  // Sends a query every 10 ms.
  std::string passing() const { return scenario("passing.toml", kAsks + std::string(kAlive)); }
  std::string failing() const {
    return scenario("failing.toml", kAsks + std::string("[[expect]]\nid = 1\nstate = \"off\"\n"));
  }
  std::string invalid() const {
    // The drive that hangs gets no query.
    return scenario("invalid.toml", kAsks + std::string(kAlive) +
                                        "[[event]]\nat_s = 0.5\nid = 2\nfault = \"hang\"\n");
  }

  static constexpr const char* kAsks =
      "[[send]]\nat_s = 0\nid = 1\ncommand = \"state_2\"\nevery_s = 0.01\n";
  static constexpr const char* kAlive = "[[expect]]\nid = 1\nsignal = \"alive\"\nmin = 1\n";

 private:
  const test::TempDirectory own_;
};

TEST_F(Run, StatusReflectsTheVerdict) {
  EXPECT_EQ(run({passing()}).status, 0);
  EXPECT_EQ(run({failing()}).status, 1);
  EXPECT_EQ(run({invalid()}).status, 3);
  EXPECT_EQ(run({path("nowhere.toml")}).status, 2);
}

TEST_F(Run, StatusIsThatOfTheWorstVerdict) {
  EXPECT_EQ(run({passing(), invalid()}).status, 3);
  EXPECT_EQ(run({invalid(), failing(), passing()}).status, 1);
  const auto unusable = run({failing(), path("nowhere.toml")});
  EXPECT_EQ(unusable.status, 2);
  EXPECT_EQ(unusable.out, "") << "nothing is run when one file is of no use";
}

TEST_F(Run, PrintsExpectedAndMeasuredValues) {
  const auto failed = run({failing()});
  EXPECT_EQ(failed.err, "");
  EXPECT_NE(failed.out.find("failing: failed"), std::string::npos) << failed.out;
  EXPECT_NE(failed.out.find("FAIL  vcan0 drive 1: off at 1 s - running at 1 s"), std::string::npos)
      << failed.out;
  EXPECT_EQ(failed.out.find('\x1b'), std::string::npos) << "no colours but on a terminal";
  const auto idle = run({invalid()});
  EXPECT_NE(idle.out.find("vcan0 hang of drive 2 began at 0.5 s and changed nothing"),
            std::string::npos)
      << idle.out;
  EXPECT_EQ(run({passing(), "--quiet"}).out, "");
  EXPECT_NE(run({failing(), "--quiet"}).out, "");
}

TEST_F(Run, EscapesNamesInReports) {
  const std::string junit = path("report.xml");
  for (const std::string& name : {std::string("\x1b[31m"), std::string("\u202E"),
                                  std::string("\xFF"), std::string("\uFFFE")}) {
    const auto result = run({scenario(name + ".toml", kAlive), "--junit", junit});
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.out.find(name), std::string::npos) << result.out;
    const std::string text = text_of(junit);
    EXPECT_EQ(text.find(name), std::string::npos) << text;
    EXPECT_NE(text.find("name=\"?"), std::string::npos) << text;
  }
}

TEST_F(Run, ErrorsNameFileLineAndKey) {
  const std::string file = scenario("bad.toml", "[[expect]]\nid = 7\nstate = \"off\"\n");
  EXPECT_EQ(run({file}).err, "lk-emu: " + file + ":4: expect.id: no drive 7 on this bus\n");
  const std::string robot = put("no_robot.toml", "robot = \"gimball\"\nduration_s = 1\n");
  EXPECT_EQ(run({robot}).err.rfind("lk-emu: " + robot +
                                       ":1: robot: no robot \"gimball\", did you mean gimbal? "
                                       "(in ",
                                   0),
            0U);
}

TEST_F(Run, RejectsBadOptionsBeforeItRuns) {
  struct {
    std::vector<std::string> arguments;
    std::string message;
  } const cases[] = {
      {{passing(), "--junit", "/nowhere/x.xml"},
       "lk-emu: --junit: cannot write /nowhere/x.xml: No such file or directory\n"},
      {{passing(), "--csv", "/nowhere/x.csv"},
       "lk-emu: --csv: cannot write /nowhere/x.csv: No such file or directory\n"},
      {{passing(), "--candump", path("")},
       "lk-emu: --candump: cannot write " + path("") + ": Is a directory\n"},
      {{passing(), failing(), "--csv", "x"}, "lk-emu: --csv: takes one scenario at a time\n"},
      {{passing(), "--rate", "10"}, "lk-emu: --rate: belongs to --csv\n"},
      {{passing(), "--csv", path("x"), "--rate", "0"},
       "lk-emu: --rate: must be 0.001 to 1000000 Hz\n"},
      {{passing(), "--csv", path("x"), "--signals", "sped_dps"},
       "lk-emu: --signals: no signal \"sped_dps\", did you mean speed_dps?\n"},
      {{passing(), "--csv", path("x"), "--ids", "7"}, "lk-emu: --ids: the robot has no drive 7\n"},
      {{passing(), "--csv", path("x"), "--ids", "2,9"},
       "lk-emu: --ids: the robot has no drive 9\n"},
      {{passing(), "--seed=-1"}, "lk-emu: --seed: must not be negative\n"},
  };
  for (const auto& one : cases) {
    const auto result = run(one.arguments);
    EXPECT_EQ(result.status, 2) << one.message;
    EXPECT_EQ(result.err, one.message);
    EXPECT_EQ(result.out, "") << one.message;
  }
  EXPECT_FALSE(fs::exists(path("x"))) << "nothing is left behind";
}

TEST_F(Run, TwoRunsWriteTheSameBytes) {
  for (const std::string n : {"1", "2"}) {
    EXPECT_EQ(run({passing(), "--csv", path(n + ".csv"), "--candump", path(n + ".log")}).status, 0);
  }
  EXPECT_FALSE(text_of(path("1.csv")).empty());
  EXPECT_EQ(text_of(path("1.csv")), text_of(path("2.csv")));
  EXPECT_FALSE(text_of(path("1.log")).empty());
  EXPECT_EQ(text_of(path("1.log")), text_of(path("2.log")));
  EXPECT_EQ(run({passing(), "--seed", "5", "--csv", path("5.csv")}).status, 0);
  EXPECT_NE(text_of(path("1.csv")), text_of(path("5.csv")));
}

/// The file may precede or follow the signals.
TEST_F(Run, CsvHasOneRowPerStepWithExactTimes) {
  const std::vector<std::string> options = {"--csv", path("x.csv"), "--rate",    "3",
                                            "--ids", "2",           "--signals", "alive,bridge_on"};
  for (const std::size_t at : {std::size_t{0}, options.size()}) {
    std::vector<std::string> arguments = options;
    arguments.insert(arguments.begin() + static_cast<std::ptrdiff_t>(at), passing());
    ASSERT_EQ(run(arguments).status, 0);
    EXPECT_EQ(
        text_of(path("x.csv")),
        "time_s,2.alive,2.bridge_on\n0,1,1\n0.333333333,1,1\n0.666666666,1,1\n0.999999999,1,1\n");
  }
}

TEST_F(Run, CandumpContainsQueriesAndReplies) {
  ASSERT_EQ(run({passing(), "--candump", path("x.log"), "--marks"}).status, 0);
  std::istringstream log(text_of(path("x.log")));
  std::string line;
  double last = -1;
  int queries = 0;
  int replies = 0;
  while (std::getline(log, line)) {
    const double at = std::stod(line.substr(1));
    EXPECT_GE(at, last);
    last = at;
    const bool sent = line.ends_with(" T");
    EXPECT_NE(sent, line.ends_with(" R")) << line;
    EXPECT_NE(line.find(sent ? " vcan0 141#9C00000000000000" : " vcan0 141#9C"), std::string::npos);
    ++(sent ? queries : replies);
  }
  EXPECT_EQ(queries, 101);  // 0, 0.01 … 1
  EXPECT_EQ(replies, 100);  // the last query is still on the wire
}

TEST_F(Run, PlaysItsOwnCandumpLog) {
  ASSERT_EQ(run({passing(), "--candump", path("x.log"), "--marks"}).status, 0);
  const std::string again =
      scenario("again.toml",
               "[[send]]\nplay = \"x.log\"\n"
               "[[expect]]\nid = 1\nreply = { command = \"state_2\", count = 100 }\n");
  EXPECT_EQ(run({again, "--candump", path("y.log"), "--marks"}).status, 0);
  EXPECT_EQ(text_of(path("x.log")), text_of(path("y.log")));
}

TEST_F(Run, CandumpHasMarksOnlyOnRequest) {
  ASSERT_EQ(run({passing(), "--candump", path("x.log")}).status, 0);
  std::istringstream log(text_of(path("x.log")));
  std::string line;
  while (std::getline(log, line)) EXPECT_EQ(std::ranges::count(line, ' '), 2) << line;
  EXPECT_EQ(run({passing(), "--marks"}).err, "lk-emu: --marks: belongs to --candump\n");
}

TEST_F(Run, WiresharkReadsTheCapture) {
  if (!lk::host::run("command -v tshark >/dev/null")) GTEST_SKIP() << "tshark is missing";
  ASSERT_EQ(run({passing(), "--capture", path("x.pcapng")}).status, 0);
  ASSERT_TRUE(lk::host::run("HOME=" + path("") + " tshark -r " + path("x.pcapng") +
                            " -T fields -e can.id -e can.len -e frame.interface_name >" +
                            path("x.txt") + " 2>" + path("x.err")))
      << text_of(path("x.err"));
  std::istringstream frames(text_of(path("x.txt")));
  std::string line;
  int count = 0;
  for (; std::getline(frames, line); ++count) EXPECT_EQ(line, "321\t8\tvcan0");  // 0x141
  EXPECT_EQ(count, 201);
}

TEST_F(Run, PrintsACountForSeveralScenarios) {
  const auto three = run({passing(), failing(), invalid()});
  EXPECT_TRUE(three.out.ends_with("\n3 scenarios: 1 passed, 1 failed, 1 invalid\n")) << three.out;
  EXPECT_EQ(run({passing(), passing(), "--quiet"}).out, "");
  EXPECT_EQ(run({passing()}).out.find("scenarios"), std::string::npos);
}

TEST_F(Run, JunitIsWellFormedAndCountsRight) {
  const std::string odd = scenario(
      "odd.toml", "[[expect]]\nid = 1\nstate = \"off\"\nsays = \"<&\\\"' off\\n\\u0007\"\n" +
                      std::string(kAlive));
  EXPECT_EQ(run({odd, invalid(), "--junit", path("x.xml")}).status, 1);
  const std::string check =
      "python3 -c \"\nimport sys, xml.etree.ElementTree as e\n"
      "suites = e.parse(sys.argv[1]).getroot().findall('testsuite')\n"
      "assert [s.get('name') for s in suites] == ['odd', 'invalid']\n"
      "assert [s.get('tests') for s in suites] == ['2', '2']\n"
      "assert [s.get('failures') for s in suites] == ['1', '0']\n"
      "assert [s.get('errors') for s in suites] == ['0', '1']\n"
      "assert len(suites[0].findall('testcase')) == 2\n"
      "assert '<&' in suites[0].findall('testcase')[0].get('name')\n"
      "assert len(suites[0].findall('testcase/failure')) == 1\n"
      "assert len(suites[1].findall('testcase/error')) == 1\n"
      "assert suites[1].find('properties/property[@name=\\\"seed\\\"]').get('value') == '1'\n"
      "\" " +
      path("x.xml");
  EXPECT_TRUE(lk::host::run(check)) << text_of(path("x.xml"));
}

TEST_F(Run, AdviceFailsTheRunWithStrict) {
  const std::string errs = scenario(
      "errs.toml", std::string(kAlive) + "[[send]]\nat_s = 0.1\nid = 1\ncommand = \"off\"\n" +
                       "[[send]]\nat_s = 0.2\nid = 1\ncommand = \"torque\"\niq_A = 1\n" +
                       "every_s = 0.1\ntimes = 3\n");
  const auto told = run({errs, "--junit", path("told.xml"), "--lang", "zh"});
  EXPECT_EQ(told.status, 0);
  EXPECT_NE(told.out.find("advice: vcan0:1: motion-refused: 驱动器已关闭"), std::string::npos)
      << told.out;
  EXPECT_EQ(run({errs, "--quiet"}).out, "");
  const auto failed = run({errs, "--quiet", "--strict", "--junit", path("failed.xml")});
  EXPECT_EQ(failed.status, 1);
  EXPECT_NE(failed.out.find("(3 times, first 141#A1"), std::string::npos) << failed.out;
  EXPECT_EQ(run({passing(), "--strict"}).status, 0);
  const std::string check =
      "python3 -c \"\nimport sys, xml.etree.ElementTree as e\n"
      "told, failed = (e.parse(name).getroot().find('testsuite') for name in sys.argv[1:])\n"
      "assert [s.get('failures') for s in (told, failed)] == ['0', '1']\n"
      "assert [s.get('tests') for s in (told, failed)] == ['1', '2']\n"
      "assert 'vcan0:1: motion-refused: the drive is off' in told.find('system-out').text\n"
      "assert failed.find('system-out') is None\n"
      "case = failed.findall('testcase')[1]\n"
      "assert case.get('name') == 'vcan0 drive 1 advice motion-refused'\n"
      "assert 'switch the drive on with 0x88' in case.find('failure').get('message')\n"
      "\" " +
      path("told.xml") + " " + path("failed.xml");
  EXPECT_TRUE(lk::host::run(check)) << text_of(path("told.xml")) << text_of(path("failed.xml"));
}

TEST_F(Run, KeepsRomOnlyOnRequest) {
  const std::string writes = scenario(
      "writes.toml", "[[send]]\nat_s = 0.1\nid = 1\ncommand = \"write_offset\"\noffset = 77\n" +
                         std::string(kAlive));
  const std::string reads =
      scenario("reads.toml",
               "[[send]]\nat_s = 0.1\nid = 1\ncommand = \"encoder\"\n"
               "[[expect]]\nid = 1\nreply = { field = \"offset\", min = 77, max = 77 }\n");
  EXPECT_EQ(run({writes}).status, 0);
  EXPECT_EQ(run({reads, "--rom", path("rom")}).status, 1);
  EXPECT_EQ(run({writes, "--rom", path("rom")}).status, 0);
  EXPECT_EQ(run({reads, "--rom", path("rom")}).status, 0);
  EXPECT_EQ(run({reads}).status, 1);
}

}  // namespace run_test
}  // namespace lk::host

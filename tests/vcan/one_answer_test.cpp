// One answer for each ID on a bus, with several programs and with real drives.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <poll.h>
#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): posix_openpt is POSIX
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>

#include "tests/host/machine_support.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace one_answer_test {

std::string refusal(const std::string& bus, int id, const EmulatorProcess& holder) {
  return "lk-emu: " + bus + ": ID " + std::to_string(id) + " is already in use by lk-emu (pid " +
         std::to_string(holder.pid()) + "); stop it, or give other --ids\n";
}

void expect_refused(const std::vector<std::string>& arguments, const std::string& message,
                    const std::vector<std::string>& launcher = {}) {
  const auto result = EmulatorProcess(arguments, launcher).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err, message);
  EXPECT_EQ(result.out, "");
}

class OneAnswer : public MachineTest {
 protected:
  ~OneAnswer() override {
    for (const char* name : {"onebus", "otherbus", "enda", "slcan0"}) {
      run("ip link del " + std::string(name) + " 2>/dev/null");
    }
  }
};

TEST_F(OneAnswer, RejectsASecondProgramUntilTheFirstIsKilled) {
  ReadyEmulator first(on("vcan0", "1-3"));
  const auto second = on("vcan0", "3-4", {"--record", path("recording")});
  expect_refused(second, refusal("vcan0", 3, first));
  EXPECT_FALSE(std::filesystem::exists(path("recording"))) << "before anything else is done";
  EmulatorProcess beside(on("vcan0", "4"));
  EXPECT_TRUE(beside.wait_ready()) << "the bus has room for other IDs";
  EmulatorProcess elsewhere(on("vcan1", "3"));
  EXPECT_TRUE(elsewhere.wait_ready());
  first.stop(SIGKILL);
  EmulatorProcess next(on("vcan0", "3"));
  EXPECT_TRUE(next.wait_ready());
}

TEST_F(OneAnswer, CoversProgramsOfOtherUsers) {
  ReadyEmulator first(on("vcan0", "3"));
  expect_refused(on("vcan0", "3"), refusal("vcan0", 3, first), as_another_user());
  ReadyEmulator theirs(on("vcan0", "5"), as_another_user());
  expect_refused(on("vcan0", "5"), refusal("vcan0", 5, theirs));
}

/// Each would store the writes that the other's replies resemble.
TEST_F(OneAnswer, SeparateRomDoesNotAvoidTheConflict) {
  std::vector<std::string> arguments = on("vcan0", "3");
  arguments[1] = path("rom");
  ReadyEmulator first(arguments);
  arguments[1] = path("other");
  expect_refused(arguments, refusal("vcan0", 3, first));
  EXPECT_FALSE(std::filesystem::exists(path("other")));
}

TEST_F(OneAnswer, TreatsAVxcanPairAsOneBus) {
  ReadyEmulator first(on("vxcan0", "3"));
  expect_refused(on("vxcan1", "2-3"), refusal("vxcan1", 3, first));
  ReadyEmulator beside(on("vxcan1", "4"));
  expect_refused(on("vxcan0", "4"), refusal("vxcan0", 4, beside));
  const auto both = on("vxcan0", "5", {"--bus", "vxcan1", "--ids", "5"});
  expect_refused(both,
                 "lk-emu: vxcan1: ID 5 is given twice: another of the buses is the other end of "
                 "this vxcan pair, or the same interface by another name\n");
}

TEST_F(OneAnswer, ResolvesAlternativeInterfaceNames) {
  if (!run("ip link property add dev vcan1 altname thesecondbus 2>/dev/null")) GTEST_SKIP();
  ReadyEmulator first(on("vcan1", "3"));
  expect_refused(on("thesecondbus", "3"), refusal("thesecondbus", 3, first));
  EXPECT_TRUE(run("ip link property del dev vcan1 altname thesecondbus"));
}

/// A program follows its interface by name, and keeps its ID locks while it waits.
TEST_F(OneAnswer, KeepsLocksWhileTheInterfaceIsAway) {
  ASSERT_TRUE(run("ip link add onebus type vcan && ip link set onebus up"));
  ReadyEmulator first(on("onebus", "3"));
  ASSERT_TRUE(run("ip link set onebus down && ip link set onebus name otherbus"));
  ASSERT_TRUE(first.wait_for_log("onebus was renamed to otherbus"));
  ASSERT_TRUE(run("ip link set otherbus up"));
  EmulatorProcess second(on("otherbus", "3"));
  EXPECT_TRUE(second.wait_ready()) << "the first has left it";
  ASSERT_TRUE(run("ip link add onebus type vcan && ip link set onebus up"));
  expect_refused(on("onebus", "3"), refusal("onebus", 3, first));
  EXPECT_TRUE(first.wait_for_log("onebus is up: continuing"));
}

TEST_F(OneAnswer, LocksCreatedInterfaces) {
  const auto arguments = on("onebus", "3", {"--create-bus"});
  ReadyEmulator first(arguments);
  expect_refused(arguments, refusal("onebus", 3, first));
}

/// A common way to lose a motor, and how to find it again.
TEST_F(OneAnswer, KeepsAnIdWrittenOverTheBusUntilRomIsWiped) {
  const std::string robot = own_.put("robot.toml",
                                     "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n"
                                     "generation = \"v236b\"\n");
  std::vector<std::string> arguments = {"--config", robot, "--rom", path("rom")};
  {
    ReadyEmulator emulator(arguments);
    Host host("vcan0");
    const Payload id_9 = {0x42, 0x05, 0x0A, 0, 9};
    EXPECT_EQ(host.query(1, id_9), id_9);
    EXPECT_EQ(host.query(1, {0x44, 0x05, 0xFA}), (Payload{0x44, 0x05, 0x01}));
    host.send(0x141, Payload{0x07});
    ASSERT_TRUE(emulator.wait_for_log("drive 1 answers at ID 9"));
    host.send(0x141, Payload{0x88});  // no reply: the next frame is the reply to the next query
    EXPECT_EQ(host.query(9, {0x88}), Payload{0x88});
    expect_refused(on("vcan0", "9"), refusal("vcan0", 9, emulator));
    // Its former ID is free.
    EmulatorProcess beside(on("vcan0", "1"));
    EXPECT_TRUE(beside.wait_ready());
  }
  {
    auto check = arguments;
    check.emplace_back("--check");
    const auto checked = EmulatorProcess(check).wait();
    EXPECT_EQ(checked.status, 0);
    EXPECT_NE(checked.out.find("drive 1: answers at ID 9"), std::string::npos) << checked.out;
    ReadyEmulator emulator(arguments);
    Host host("vcan0");
    EXPECT_EQ(host.query(9, {0x88}), Payload{0x88});
    const auto result = emulator.stop();
    EXPECT_NE(result.out.find("lk-emu ready vcan0:1 (1 answers at ID 9)"), std::string::npos)
        << result.out;
    EXPECT_NE(result.err.find("drive 1 answers at ID 9"), std::string::npos) << result.err;
  }
  arguments.emplace_back("--wipe-rom");
  ReadyEmulator emulator(arguments);
  Host host("vcan0");
  EXPECT_EQ(host.query(1, {0x88}), Payload{0x88});
}

/// Locks do not reach this bus, and every query gets a second answer.
TEST_F(OneAnswer, AdviceReportsADriveInAnotherNamespace) {
  ASSERT_TRUE(run("ip link add enda type vxcan peer name endb && ip link set enda up"));
  const std::string move_in =
      "nsenter --net=/proc/" + std::to_string(::getpid()) +
      "/ns/net ip link set endb netns $$ && ip link set endb up && exec \"$@\"";
  ReadyEmulator there(on("endb", "3"), {"unshare", "--net", "sh", "-c", move_in, "sh"});
  const auto arguments = on("enda", "3", {"--lang", "en"});
  EmulatorProcess here(arguments);
  ASSERT_TRUE(here.wait_ready()) << "the other end is in a network of its own";
  Host("enda").send(0x143, kReadState2);
  EXPECT_TRUE(here.wait_for_log("enda:3: duplicate-id: 25 °C where a query has 0"));
}

/// A CAN interface that is not virtual, with its adapter: slcan on a pseudo-terminal.
class RealBus : public OneAnswer {
 protected:
  void SetUp() override {
    run("insmod /usr/lib/uml/modules/$(uname -r)/kernel/drivers/net/can/slcan/slcan.ko "
        "2>/dev/null || modprobe slcan 2>/dev/null");
    ASSERT_GE(adapter_, 0);
    ASSERT_EQ(::grantpt(adapter_), 0);
    ASSERT_EQ(::unlockpt(adapter_), 0);
    line_ = ::open(::ptsname(adapter_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    ASSERT_EQ(::tcgetattr(line_, &raw), 0);
    ::cfmakeraw(&raw);
    ASSERT_EQ(::tcsetattr(line_, TCSANOW, &raw), 0);
    const int discipline = 17;  // N_SLCAN of linux/tty.h
    if (::ioctl(line_, TIOCSETD, &discipline) != 0) GTEST_SKIP() << "no slcan in this kernel";
    std::array<char, IFNAMSIZ> name{};  // slcan0, and can0 from Linux 6.0 on
    ASSERT_EQ(::ioctl(line_, SIOCGIFNAME, name.data()), 0);
    ASSERT_TRUE(
        run(std::string("ip link set ") + name.data() + " name slcan0 && ip link set slcan0 up"));
  }
  ~RealBus() override {
    ::close(line_);
    ::close(adapter_);
  }
  /// Returns the interface's output in slcan, up to the end of a frame.
  std::string adapter_reads() const {
    std::string text;
    pollfd ready{adapter_, POLLIN, 0};
    while (text.find('\r') == std::string::npos && ::poll(&ready, 1, kPatience_ms) > 0) {
      char byte = 0;
      if (::read(adapter_, &byte, 1) != 1) break;
      text += byte;
    }
    return text;
  }

  int adapter_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  int line_ = -1;
};

TEST_F(RealBus, RequiresRealBusOption) {
  const std::string message =
      "lk-emu: slcan0 is not virtual (vcan, vxcan): real drives may be on it, and one with the "
      "same ID would answer too; if no drive on it has these IDs, start with --real-bus\n";
  expect_refused(on("slcan0", "3"), message);
  const auto create = on("slcan0", "3", {"--create-bus"});
  expect_refused(create, message);
}

TEST_F(RealBus, AnswersWithRealBusOption) {
  const auto arguments = on("slcan0", "3", {"--real-bus"});
  ReadyEmulator emulator(arguments);
  const std::string query = "t14388800000000000000\r";  // 0x88, answered with an echo
  ASSERT_EQ(::write(adapter_, query.data(), query.size()), static_cast<ssize_t>(query.size()));
  EXPECT_EQ(adapter_reads(), query);
}

TEST_F(RealBus, IsNotUsedInPlaceOfAVirtualOne) {
  ASSERT_TRUE(run("ip link add onebus type vcan && ip link set onebus up"));
  ReadyEmulator emulator(on("onebus", "3"));
  ASSERT_TRUE(
      run("ip link del onebus && ip link set slcan0 down && "
          "ip link set slcan0 name onebus && ip link set onebus up"));
  ASSERT_TRUE(emulator.wait_for_log("onebus is not a virtual interface any more"));
  ASSERT_TRUE(
      run("ip link set onebus down && ip link set onebus name slcan0 && "
          "ip link add onebus type vcan && ip link set onebus up"));
  ASSERT_TRUE(emulator.wait_for_log("onebus is up: continuing"));
  EXPECT_TRUE(Host("onebus").query(3, kReadState2));
  EXPECT_EQ(count_of(emulator.stop().err, "not a virtual interface"), 1);
}

}  // namespace one_answer_test
}  // namespace lk::host

// The program on its interfaces: ignored frames, interfaces that come and go, several buses.

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_bits.hpp"
#include "tests/host/host.hpp"
#include "tests/host/machine_support.hpp"
#include "tests/support/temp_directory.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace bus_test {

using namespace std::chrono_literals;

/// A private vcan, so that adding and removing it affects no other test.
class OwnInterface {
 public:
  explicit OwnInterface(std::string name) : name_(std::move(name)) { create(); }
  OwnInterface(const OwnInterface&) = delete;
  OwnInterface& operator=(const OwnInterface&) = delete;
  ~OwnInterface() { run("ip link del " + name_ + " 2>/dev/null"); }

  void up() const { ip("link set " + name_ + " up"); }
  void down() const { ip("link set " + name_ + " down"); }
  void remove() const { ip("link del " + name_); }
  void create() const {
    ip("link add " + name_ + " type vcan");
    up();
  }

 private:
  static void ip(const std::string& what) { ASSERT_TRUE(run("ip " + what)) << what; }

  std::string name_;
};

std::string summary_line(const std::string& text, const std::string& what) {
  const auto start = text.find(what);
  return start == std::string::npos ? "" : text.substr(start, text.find('\n', start) - start);
}

TEST(BadFrames, AreCountedByCauseAndNotAnswered) {
  ReadyEmulator emulator(on("vcan0", "1-2"));
  Host host("vcan0");
  can_frame frame{};
  frame.data[0] = 0x9C;
  frame.can_id = 0x141;
  for (std::uint8_t length = 0; length < 8; ++length) {
    frame.len = length;
    host.send(frame);
  }
  frame.len = 8;
  frame.can_id = 0x141 | CAN_EFF_FLAG;
  host.send(frame);
  frame.can_id = 0x141 | CAN_RTR_FLAG;
  host.send(frame);
  for (const canid_t id : {0x140U, 0x143U, 0x161U, 0x241U, 0x7FFU}) host.send(id, kReadState2);
  canfd_frame fd{};
  fd.can_id = 0x141;
  fd.len = 8;
  fd.data[0] = 0x9C;
  host.send(fd);
  host.send(0x280, {});
  // A reply to one of them would arrive before this one.
  const auto reply = host.query(2, kReadState2);
  ASSERT_TRUE(reply);

  const auto result = emulator.stop();
  EXPECT_EQ(result.status, 0);
  const auto count = [&](const char* cause) {
    const std::string line = summary_line(result.out, std::string("not answered: ") + cause);
    return line.empty() ? 0 : std::stoi(line.substr(line.find_last_of(' ')));
  };
  EXPECT_EQ(count("wrong length"), 8) << result.out;
  EXPECT_EQ(count("extended identifier"), 1) << result.out;
  EXPECT_EQ(count("remote request"), 1) << result.out;
  EXPECT_EQ(count("CAN FD frame"), 1) << result.out;
  EXPECT_EQ(count("foreign identifier"), 4) << result.out;
  EXPECT_EQ(count("no such drive"), 1) << result.out;
}

TEST(BadFrames, KernelFiltersForeignFramesWithoutABitRate) {
  ReadyEmulator emulator(on("vcan0", "1", {"--bitrate", "0"}));
  Host host("vcan0");
  for (const canid_t id : {0x000U, 0x13FU, 0x180U, 0x27FU, 0x290U, 0x7FFU})
    host.send(id, kReadState2);
  host.send(0x145, kReadState2);
  ASSERT_TRUE(host.query(1, kReadState2));
  const auto result = emulator.stop();
  EXPECT_NE(result.out.find(" 2 frames, 1 queries, 1 replies"), std::string::npos) << result.out;
}

TEST(Buses, TwoRunAtOnceWithThirtyTwoIds) {
  ReadyEmulator emulator(
      {"--rom", ":memory:", "--bus", "vcan0", "--ids", "1-32", "--bus", "vcan1", "--ids", "5,7-9"});
  Host first("vcan0");
  Host second("vcan1");
  for (int id = 1; id <= 32; ++id) EXPECT_TRUE(first.query(id, kReadState2)) << id;
  for (const int id : {5, 7, 8, 9}) EXPECT_TRUE(second.query(id, kReadState2)) << id;
  second.send(0x141, kReadState2);
  const auto reply = second.query(5, kReadState2);
  EXPECT_TRUE(reply) << "ID 1 is on the other bus only";
  const auto result = emulator.stop();
  EXPECT_EQ(result.out.rfind("lk-emu ready vcan0:1-32 vcan1:5,7-9\n", 0), 0U) << result.out;
}

TEST(Buses, BurstOfQueriesIsAnsweredOnce) {
  ReadyEmulator emulator(on("vcan0", "1-32", {"--bitrate", "0"}));
  Host host("vcan0");
  // Without a bit rate, queries that waited while the program was delayed arrive at one instant,
  // and must fit into each drive's queue.
  constexpr int kRounds = 20, kAtOnce = 100;
  const auto drive = [](int n) { return 0x141U + static_cast<canid_t>(n % 32); };
  for (int round = 0; round < kRounds; ++round) {
    for (int n = 0; n < kAtOnce; ++n) host.send(drive(n), kReadState2);
    for (int n = 0; n < kAtOnce; ++n) {
      const auto reply = host.receive();
      ASSERT_TRUE(reply) << round << ", " << n;
      ASSERT_EQ(reply->can_id, drive(n)) << round << ", " << n;
    }
  }
  const auto result = emulator.stop();
  EXPECT_NE(result.out.find(" 2000 frames, 2000 queries, 2000 replies"), std::string::npos)
      << result.out;
}

// As root. The receive buffer needs a capability, which the program drops after its start.
TEST(Buses, ReceiveBufferHoldsABurstDuringAStop) {
  ReadyEmulator emulator(on("vcan0", "1-2", {"--bitrate", "0"}));
  Host host("vcan0");
  emulator.signal(SIGSTOP);
  constexpr int kQueries = 3000;  // about four times the system's default limit
  for (int n = 0; n < kQueries; ++n) host.send(0x141, kReadState2);
  emulator.signal(SIGCONT);
  host.send(0x142, kReadState2);
  for (auto reply = host.receive(); reply && reply->can_id != 0x142;) reply = host.receive();
  const auto result = emulator.stop();
  EXPECT_NE(result.out.find(" 3001 frames"), std::string::npos) << result.out;
  EXPECT_EQ(result.out.find("dropped by the kernel"), std::string::npos) << result.out;
}

TEST(Buses, TwoHostsSeeEachOthersQueriesAndAllReplies) {
  ReadyEmulator emulator(on("vcan0", "1-2"));
  Host host("vcan0");
  Host other("vcan0");
  host.send(0x141, {0x9A});
  const auto query = other.receive();
  ASSERT_TRUE(query);
  EXPECT_EQ(query->can_id, 0x141U);
  EXPECT_EQ(query->data[3], 0) << "the query";
  const auto reply = other.receive();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->can_id, 0x141U);
  EXPECT_NE(reply->data[3], 0) << "the reply, with the voltage";
  EXPECT_TRUE(host.receive());
  // The opposite direction.
  EXPECT_TRUE(other.query(2, kReadState2));
}

TEST(Buses, ShippedRobotsAnswer) {
  const test::TempDirectory own;
  const std::filesystem::path robots = std::filesystem::path(LKEMU_SOURCE_DIR) / "configs/buses";
  for (const char* robot : {"gimbal", "turntable", "bench"}) {
    SCOPED_TRACE(robot);
    ReadyEmulator emulator({"--config", (robots / robot).replace_extension("toml"), "--bus",
                            "vcan0", "--rom", own.path("rom")});
    Host host("vcan0");
    EXPECT_EQ(host.query(1, {0x9C}).value_or(Payload{})[0], 0x9C);
    EXPECT_EQ(emulator.stop().status, 0);
  }
  ReadyEmulator emulator({"--config", robots / "quadruped.toml", "--rom", own.path("rom")});
  Host front("vcan0");
  Host hind("vcan1");
  for (int id = 1; id <= 6; ++id) EXPECT_TRUE(front.query(id, {0x92})) << id;
  for (int id = 7; id <= 12; ++id) EXPECT_TRUE(hind.query(id, {0x92})) << id;
}

struct Exchange {
  std::chrono::steady_clock::duration took;
  std::chrono::microseconds on_wire;  // both frames, at 1 Mbit/s
  bool answered;
};

std::chrono::microseconds wire_time(int id, const Payload& data) {
  protocol::Frame frame;
  frame.id = 0x140U + static_cast<unsigned>(id);
  std::ranges::copy(data, frame.data.begin());
  return std::chrono::microseconds(protocol::frame_bits(frame));
}

std::vector<Exchange> ask_in_turns(const std::vector<int>& ids, int rounds) {
  Host host("vcan0");
  host.hear_only(ids);
  std::vector<Exchange> all;
  for (int n = 0; n < rounds; ++n) {
    for (const int id : ids) {
      const auto start = std::chrono::steady_clock::now();
      const auto reply = host.query(id, kReadState2);
      const auto took = std::chrono::steady_clock::now() - start;
      all.push_back({took, wire_time(id, kReadState2) + wire_time(id, reply.value_or(Payload{})),
                     reply.has_value()});
    }
  }
  return all;
}

TEST(Buses, EightHostsGetAllRepliesNeverEarly) {
  constexpr int kHosts = 8;
  constexpr int kRounds = 10;
  ReadyEmulator emulator(on("vcan0", "1-32"));
  std::vector<std::future<std::vector<Exchange>>> hosts;
  const auto start = std::chrono::steady_clock::now();
  for (int first = 1; first <= kHosts; ++first) {
    hosts.push_back(std::async(std::launch::async, [first] {
      return ask_in_turns({first, first + 8, first + 16, first + 24}, kRounds);
    }));
  }
  std::chrono::microseconds all_on_wire{0};
  for (auto& host : hosts) {
    for (const Exchange& exchange : host.get()) {
      ASSERT_TRUE(exchange.answered);
      // The drive's own reply time; simulated time has whole microseconds.
      EXPECT_GE(exchange.took, exchange.on_wire + 100us - 1us);
      all_on_wire += exchange.on_wire;
    }
  }
  EXPECT_GE(std::chrono::steady_clock::now() - start, all_on_wire) << "one frame at a time";
  const auto result = emulator.stop();
  EXPECT_NE(result.out.find(" 320 frames, 320 queries, 320 replies"), std::string::npos)
      << result.out;
}

TEST(Buses, VxcanPairNeedsNoLoopback) {
  ReadyEmulator emulator(on("vxcan1", "1"));
  Host host("vxcan0", Host::Loopback::kOff);
  EXPECT_TRUE(host.query(1, kReadState2));
}

TEST(Interface, RecoversAfterDownAndUp) {
  const OwnInterface bus("vcandown");
  ReadyEmulator emulator(on("vcandown", "1"));
  for (int round = 1; round <= 2; ++round) {
    bus.down();
    ASSERT_TRUE(emulator.wait_for_log("vcandown is down: waiting for it", round));
    bus.up();
    ASSERT_TRUE(emulator.wait_for_log("vcandown is up: continuing", round));
    Host host("vcandown");
    EXPECT_TRUE(host.query(1, kReadState2));
  }
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST(Interface, RecoversAfterDeletion) {
  const OwnInterface bus("vcangone");
  ReadyEmulator emulator(on("vcangone", "1"));
  bus.remove();
  ASSERT_TRUE(emulator.wait_for_log("vcangone is gone: waiting"));
  bus.create();
  ASSERT_TRUE(emulator.wait_for_log("vcangone is up: continuing"));
  Host host("vcangone");
  EXPECT_TRUE(host.query(1, kReadState2));
  const auto result = emulator.stop();
  EXPECT_EQ(result.status, 0);
}

TEST(Interface, IsAwaitedIfDownAtStart) {
  const OwnInterface bus("vcanlate");
  bus.down();
  EmulatorProcess emulator(on("vcanlate", "1"));
  ASSERT_TRUE(emulator.wait_for_log("vcanlate is down: waiting for it"));
  bus.up();
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcanlate");
  EXPECT_TRUE(host.query(1, kReadState2));
}

TEST(Interface, ReportsDownAtStartToTheServiceManager) {
  const OwnInterface bus("vcanlate");
  bus.down();
  const test::TempDirectory own;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string place = own.path("notify");
  std::ranges::copy(place, address.sun_path);
  const int manager = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(manager, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  // As with systemd, everybody may write to the socket. On a file system of the host it belongs to
  // the host's user, and lk-emu has given up the capability to ignore permissions.
  ASSERT_EQ(::chmod(own.path().c_str(), 0755), 0);
  ASSERT_EQ(::chmod(place.c_str(), 0777), 0);
  const auto told = [manager] {
    char text[256];
    pollfd readable{manager, POLLIN, 0};
    if (::poll(&readable, 1, kPatience_ms) < 1) return std::string();
    const ssize_t size = ::recv(manager, text, sizeof text, 0);
    return std::string(text, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  };
  EmulatorProcess emulator(on("vcanlate", "1"), {"env", "NOTIFY_SOCKET=" + place});
  EXPECT_EQ(told(), "STATUS=waiting for an interface to be up");
  bus.up();
  EXPECT_EQ(told(), "READY=1\nSTATUS=ready vcanlate:1");
  EXPECT_EQ(emulator.stop().status, 0);
  EXPECT_EQ(told(), "STOPPING=1");
  ::close(manager);
}

TEST(Interface, ScenarioThatNeverStartsIsInvalid) {
  const test::TempDirectory own;
  const std::string file =
      own.put("live.toml", "duration_s = 1\n[[expect]]\nid = 1\nstate = \"running\"\n");
  const std::string junit = own.path("junit.xml");
  const OwnInterface bus("vcandown");
  bus.down();
  EmulatorProcess emulator({"--rom", ":memory:", "--control", "none", "--bus", "vcandown", "--ids",
                            "1", "--scenario", file, "--junit", junit});
  EXPECT_TRUE(emulator.wait_for_log("vcandown is down: waiting"));
  const auto result = emulator.stop();
  EXPECT_EQ(result.status, 3) << result.out;
  const std::string why = "invalid: the scenario never began, an interface was down";
  EXPECT_NE(result.out.find(why + "\n"), std::string::npos) << result.out;
  const std::string xml = own.text_of("junit.xml");
  EXPECT_NE(xml.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
  EXPECT_NE(xml.find(why), std::string::npos) << xml;
}

TEST(Interface, MissingErrorListsTheCommandsToCreateIt) {
  const auto result = EmulatorProcess(on("vcanno", "1")).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err,
            "lk-emu: interface not found: vcanno; create it with: sudo ip link add vcanno type "
            "vcan && sudo ip link set vcanno up (or start with --create-bus)\n");
}

TEST(Interface, RejectsOtherKindsThanCan) {
  const auto result = EmulatorProcess(on("lo", "1")).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err, "lk-emu: lo is not a CAN interface\n");
}

TEST(CreateBus, CreatesTheInterfaceAndBringsItUp) {
  run("ip link del vcanmade 2>/dev/null");
  ReadyEmulator emulator(on("vcanmade", "1", {"--create-bus"}));
  {
    Host host("vcanmade");
    EXPECT_TRUE(host.query(1, kReadState2));
  }
  EXPECT_EQ(emulator.stop().status, 0);
  EXPECT_TRUE(run("ip link del vcanmade"));
}

/// A vulnerability then gives an attacker no capabilities.
TEST(CreateBus, DropsCapabilitiesAfterCreation) {
  ReadyEmulator emulator(on("vcanmade", "1", {"--create-bus"}));
  auto status = process_status(emulator.pid());
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"}) {
    EXPECT_EQ(status[set], "0000000000000000") << set;
  }
  EXPECT_EQ(status["NoNewPrivs"], "1");
  EXPECT_TRUE(run("ip link set vcanmade down && ip link set vcanmade up"));
  EXPECT_TRUE(emulator.wait_for_log("vcanmade is up: continuing"));
  EXPECT_EQ(emulator.stop().status, 0);
  EXPECT_TRUE(run("ip link del vcanmade"));
}

TEST(CreateBus, BringsUpAnExistingInterface) {
  const OwnInterface bus("vcandead");
  bus.down();
  EmulatorProcess emulator(on("vcandead", "1", {"--create-bus"}));
  EXPECT_TRUE(emulator.wait_ready());
}

TEST(CreateBus, NamesTheMissingPermission) {
  const auto result =
      EmulatorProcess(on("vcanperm", "1", {"--create-bus"}), as_another_user()).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err,
            "lk-emu: no permission to make vcanperm: --create-bus needs root or CAP_NET_ADMIN\n");
}

TEST(Stop, WorksWhileTheInterfaceIsGone) {
  const OwnInterface bus("vcanstop");
  ReadyEmulator emulator(on("vcanstop", "1"));
  bus.remove();
  ASSERT_TRUE(emulator.wait_for_log("vcanstop is gone"));
  EXPECT_EQ(emulator.stop().status, 0);
}

}  // namespace bus_test
}  // namespace lk::host

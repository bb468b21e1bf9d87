// Frames that nothing acknowledges, as hosts on SocketCAN see them: a raw socket, candump,
// python-can.

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <fstream>
#include <string>
#include <utility>

#include "tests/host/machine_support.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace host_side_test {

constexpr const char* kRobot = R"(
[[bus]]
interface = "vcan0"

[[bus.drive]]
id = 1

[[bus.event]]
when = { id = 1, command = 0x9A }
fault = { kind = "no_ack", for_s = 1 }
)";

constexpr const char* kPython = R"(
import can
with can.Bus("vcan0", interface="socketcan") as bus:
    left = 3
    while left:
        message = bus.recv(20)
        if message.is_error_frame:
            print(f"{message.arbitration_id:x} {message.data[6]}")
            left -= 1
)";

int error_listeners() { return count_of(text_of("/proc/net/can/rcvlist_err"), "vcan0"); }

TEST(HostSide, ErrorFramesReachRawSocketsCandumpAndPythonCan) {
  const test::TempDirectory own;
  std::ofstream(own.path("robot.toml")) << kRobot;
  std::ofstream(own.path("host.py")) << kPython;
  ReadyEmulator emulator(
      {"--rom", ":memory:", "--control", "none", "--config", own.path("robot.toml")});
  const int before = error_listeners();
  const std::string end = " & } 2>&1";
  ASSERT_TRUE(run("{ candump -n 3 vcan0,1FFFFFFF:1FFFFFFF,#FFFFFFFF > " + own.path("dump") + end));
  ASSERT_TRUE(run("{ /usr/bin/python3 " + own.path("host.py") + " > " + own.path("python") + end));
  ASSERT_TRUE(wait_until([before] { return error_listeners() == before + 2; }));
  Host host("vcan0");
  host.hear_errors();
  host.send(0x141, {0x9A});
  host.send(0x141, {0x9C});
  // No acknowledgement, then 96 and 128 transmit errors; the host never goes off the bus.
  for (const auto& [id, errors] : {std::pair{CAN_ERR_ACK | CAN_ERR_CNT, 8},
                                   {CAN_ERR_CRTL | CAN_ERR_CNT, 96},
                                   {CAN_ERR_CRTL | CAN_ERR_CNT, 128}}) {
    const auto report = host.receive();
    ASSERT_TRUE(report);
    EXPECT_EQ(report->can_id, CAN_ERR_FLAG | id);
    EXPECT_EQ(report->data[6], errors);
  }
  const auto reply = host.receive();  // the cable is back, and the queue is sent
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->can_id, 0x141U);
  EXPECT_EQ(reply->data[0], 0x9C);
  EXPECT_TRUE(
      wait_until([&] { return text_of(own.path("python")) == "220 8\n204 96\n204 128\n"; }));
  EXPECT_TRUE(wait_until([&] { return count_of(text_of(own.path("dump")), "ERRORFRAME") == 3; }));
  EXPECT_EQ(emulator.stop().status, 0);
}

}  // namespace host_side_test
}  // namespace lk::host

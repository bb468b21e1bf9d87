#include "emulator/transports/cannelloni_port.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <sstream>
#include <string>

#include "emulator/ground/start_error.hpp"
#include "emulator/transports/own_addresses.hpp"
#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace cannelloni_port_test {

using test::frame;

BusName place_of(const std::string& address, std::uint16_t port, std::uint16_t local_port) {
  return {.scheme = nullptr, .address = address, .port = port, .local_port = local_port};
}

TEST(CannelloniPort, ThisMachineWithTheSamePortIsNoOtherEnd) {
  boost::asio::io_context loop;
  const auto own = addresses_of_this_machine();
  EXPECT_TRUE(own.contains(boost::asio::ip::make_address("127.0.0.1")));
  for (const auto& address : own) {
    const BusName place = place_of(address.to_string(), 20000, 20000);
    try {
      const CannelloniPort port(loop, "bus", place, [] {});
      ADD_FAILURE() << address << " is taken";
    } catch (const StartError& problem) {
      EXPECT_EQ(problem.what(), "bus: " + place.address +
                                    " is this machine, so the two ends cannot have the same port: "
                                    "give ?local=PORT another");
    }
  }
}

/// What the kernel refuses to send, as it does without a route: to all, unless that is asked for.
TEST(CannelloniPort, SaysOnceWhyNothingCanBeSent) {
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  const auto mine = std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log));
  mine->set_pattern("%v");
  boost::asio::io_context loop;
  CannelloniPort port(loop, "bus", place_of("255.255.255.255", 20000, 0), [] {});
  spdlog::set_default_logger(mine);
  const std::array replies{frame("141#9A"), frame("142#9A")};
  port.send(replies);
  port.send(replies);
  spdlog::set_default_logger(before);
  EXPECT_EQ(log.str(),
            "bus: cannot send to 255.255.255.255: Permission denied; replies are lost while this "
            "lasts\n");
  EXPECT_EQ(port.stats().lost_link_down, 4U);
}

}  // namespace cannelloni_port_test
}  // namespace lk::emulator

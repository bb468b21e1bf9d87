#include "emulator/config/bus_name.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace lk::emulator {
namespace bus_name_test {

std::string problem(const std::string& name) {
  const auto parsed = parse_bus_name(name);
  const auto* const text = std::get_if<std::string>(&parsed);
  return text != nullptr ? *text : "";
}

TEST(BusName, ABareNameIsAnInterface) {
  const BusName name = bus_name("vcan0");
  EXPECT_EQ(name.scheme->transport, Transport::kSocketCan);
  EXPECT_EQ(name.path, "vcan0");
}

TEST(BusName, ExamplesMatchTheirSchemes) {
  for (const BusScheme& scheme : bus_schemes()) {
    const std::string example(scheme.example);
    ASSERT_EQ(problem(example), "");
    EXPECT_EQ(bus_name(example).scheme, &scheme);
    EXPECT_EQ(is_serial_name(example), scheme.serial);
  }
}

TEST(BusName, PortsDefaultToLoopback) {
  EXPECT_EQ(bus_name("slcan-tcp:29536").address, "127.0.0.1");
  EXPECT_EQ(bus_name("slcan-tcp:29536").port, 29536);
  EXPECT_EQ(bus_name("slcan-tcp:localhost:1").address, "127.0.0.1");
  EXPECT_EQ(bus_name("slcan-tcp:0.0.0.0:65535").address, "0.0.0.0");
  EXPECT_EQ(bus_name("slcan-tcp:[::1]:29536").address, "::1");
  EXPECT_EQ(bus_name("slcan-tcp:[::1]:29536").port, 29536);
  EXPECT_TRUE(bus_name("slcan-tcp:[::1]:29536").acks);
  EXPECT_FALSE(bus_name("slcan-tcp:[::1]:29536?acks=no").acks);
  EXPECT_EQ(bus_name("slcan-tcp:29536?acks=no").port, 29536);
}

TEST(BusName, MulticastGroupDefaultsToThatOfPythonCan) {
  const BusName plain = bus_name("udp-multicast:");
  EXPECT_EQ(plain.address, "ff15:7079:7468:6f6e:6465:6d6f:6d63:6173");
  EXPECT_EQ(plain.port, 43113);
  EXPECT_EQ(plain.ttl, 0);
  EXPECT_EQ(bus_name("udp-multicast::5000").port, 5000);
  EXPECT_EQ(bus_name("udp-multicast:239.74.163.2").address, "239.74.163.2");
  EXPECT_EQ(bus_name("udp-multicast:[ff02::1]:5000").address, "ff02::1");
  EXPECT_EQ(bus_name("udp-multicast:[ff02::1]:5000").port, 5000);
  EXPECT_EQ(bus_name("udp-multicast:[fF02::1]").address, "ff02::1");
  EXPECT_EQ(bus_name("udp-multicast:?ttl=1").ttl, 1);
  for (const char* name :
       {"udp-multicast:127.0.0.1", "udp-multicast:240.0.0.0", "udp-multicast:ff02::1",
        "udp-multicast:[fe80::1]", "udp-multicast:[ff::1]", "udp-multicast:?ttl=0",
        "udp-multicast::", "udp-multicast:239.1.1.1:"}) {
    EXPECT_NE(problem(name), "") << name;
  }
}

TEST(BusName, SchemeAloneNamesTheMissingPart) {
  EXPECT_EQ(problem("slcan-tcp"), "slcan-tcp: needs a port, like slcan-tcp:29536");
  EXPECT_EQ(problem("rs485-tcp"), "rs485-tcp: needs a port, like rs485-tcp:29485");
  EXPECT_EQ(problem("socketcand"), "socketcand: needs a port, like socketcand:29536");
  EXPECT_EQ(problem("rs485"), "rs485: needs a path, like rs485:/tmp/arm");
  EXPECT_EQ(problem("udp-multicast"),
            "udp-multicast: needs a group, like udp-multicast:239.74.163.2");
  EXPECT_EQ(problem("slcan"), "") << "an interface may be called so";
}

TEST(BusName, RejectsMalformedNames) {
  for (const char* name : {"slcan-tcp:",
                           "slcan-tcp:1?acks=yes",
                           "slcan-tcp:?acks=no",
                           "rs485-tcp:1?acks=no",
                           "slcan-tcp:0",
                           "slcan-tcp:65536",
                           "slcan-tcp:-1",
                           "slcan-tcp:+1",
                           "slcan-tcp:1x",
                           "slcan-tcp:host:1",
                           "slcan-tcp:::1:1",
                           "slcan-tcp:[127.0.0.1]:1",
                           "slcan-tcp:[::1]",
                           "slcan-tcp:[]:1",
                           "slcan-tcp:127.0.0.1:",
                           "slcan-tcp: 1",
                           "rs485:",
                           "rs485:/tmp/a b",
                           "slcan-pty:",
                           "slcan:29536",
                           "tcp://1",
                           ""}) {
    EXPECT_NE(problem(name), "") << name;
  }
  EXPECT_NE(problem("slcan-pty:/" + std::string(90, 'x')), "");
}

TEST(BusName, UnknownKindIsNamedInTheError) {
  EXPECT_EQ(problem("cannelloni:192.168.0.3:20000"),
            "\"cannelloni:192.168.0.3:20000\": unknown kind of bus \"cannelloni:\"; examples: " +
                bus_examples());
}

/// The table in the document agrees with the program's.
TEST(BusName, DocumentListsEachScheme) {
  std::ifstream file(LKEMU_SOURCE_DIR "/docs/guides/buses.md");
  std::stringstream page;
  page << file.rdbuf();
  for (const BusScheme& scheme : bus_schemes()) {
    std::ostringstream row;
    row << "| `" << scheme.form << "` | `" << scheme.example << "` | " << scheme.hosts << " |\n";
    EXPECT_NE(page.str().find(row.str()), std::string::npos) << row.str();
  }
}

}  // namespace bus_name_test
}  // namespace lk::emulator

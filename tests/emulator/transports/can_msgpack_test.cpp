// Datagrams as python-can 4.1 packs them (can/interfaces/udp_multicast/utils.py), byte for byte.

#include <gtest/gtest.h>

#include <string_view>

#include "emulator/io/transports/multicast_port.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/serial.hpp"

namespace lk::emulator {
namespace can_msgpack_test {

using protocol::Frame;
using protocol::FrameKind;
using test::bytes;
using test::frame;
using namespace std::chrono_literals;

// pack_message(can.Message(arbitration_id=0x141, data=b"\x9A" + bytes(7), is_extended_id=False))
constexpr std::string_view kQuery =
    "8ba974696d657374616d70cb0000000000000000ae6172626974726174696f6e5f6964cd0141ae69735f657874656e"
    "6465645f6964c2af69735f72656d6f74655f6672616d65c2ae69735f6572726f725f6672616d65c2a76368616e6e65"
    "6cc0a3646c6308a464617461c4089a00000000000000a569735f6664c2ae626974726174655f737769746368c2b565"
    "72726f725f73746174655f696e64696361746f72c2";
// pack_message(can.Message(arbitration_id=0x12345678, is_remote_frame=True, dlc=3))
constexpr std::string_view kRemote =
    "8ba974696d657374616d70cb0000000000000000ae6172626974726174696f6e5f6964ce12345678ae69735f657874"
    "656e6465645f6964c3af69735f72656d6f74655f6672616d65c3ae69735f6572726f725f6672616d65c2a76368616e"
    "6e656cc0a3646c6303a464617461c400a569735f6664c2ae626974726174655f737769746368c2b56572726f725f73"
    "746174655f696e64696361746f72c2";

/// With the time stamp 0.1, an IEEE 754 double.
std::vector<std::uint8_t> stamped(std::string_view digits) {
  std::string text(digits);
  text.replace(text.find("cb0000000000000000"), 18, "cb3fb999999999999a");
  return bytes(text);
}

TEST(CanMsgpack, RoundTripsEachKindOfFrame) {
  const Frame query = frame("141#9A00000000000000");
  EXPECT_EQ(parse_can_msgpack(bytes(kQuery)), query);
  EXPECT_EQ(can_msgpack(query, 100ms), stamped(kQuery));
  const Frame remote{.id = 0x12345678, .kind = FrameKind::kRemote, .extended = true, .dlc = 3};
  EXPECT_EQ(parse_can_msgpack(bytes(kRemote)), remote);
  EXPECT_EQ(can_msgpack(remote, 100ms), stamped(kRemote));
  const auto error = parse_can_msgpack(can_msgpack({.id = 8, .kind = FrameKind::kError}, 1s));
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind, FrameKind::kError);
}

/// Changes the value byte of a query at `at`.
std::optional<Frame> with(std::size_t at, std::uint8_t value) {
  std::vector<std::uint8_t> changed = bytes(kQuery);
  changed.at(at) = value;
  return parse_can_msgpack(changed);
}

TEST(CanMsgpack, RejectsMalformedMessages) {
  const auto whole = bytes(kQuery);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_can_msgpack(std::span(whole).first(size))) << size;
  }
  auto more = whole;
  more.push_back(0xC0);
  EXPECT_FALSE(parse_can_msgpack(more));
  const std::string_view text(reinterpret_cast<const char*>(whole.data()), whole.size());
  EXPECT_FALSE(with(text.find("arbitration_id") + 15, 0x08));  // 0x841, not extended
  EXPECT_FALSE(with(text.find("dlc") + 3, 9));
  EXPECT_FALSE(with(text.find("dlc") + 3, 7));    // but there are eight bytes
  EXPECT_FALSE(with(text.find("is_fd") + 5, 1));  // not a boolean
  EXPECT_EQ(with(text.find("is_fd") + 5, 0xC3)->kind, FrameKind::kFd);
  EXPECT_FALSE(parse_can_msgpack(std::vector<std::uint8_t>(kLongestCanMsgpack, 0x91)));
  EXPECT_FALSE(parse_can_msgpack(bytes("dfffffffff")));
  EXPECT_FALSE(parse_can_msgpack(bytes("c0")));
}

}  // namespace can_msgpack_test
}  // namespace lk::emulator

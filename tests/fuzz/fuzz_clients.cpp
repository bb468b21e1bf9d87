// Bytes of clients: slcan, socketcand, RFC 2217, and datagrams of python-can.
//
// Input: a byte that chooses the protocol and the slices, then what the client sends. In slices and
// at once it comes to the same; what is understood can be said again; nothing grows without bound.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "emulator/transports/can_msgpack.hpp"
#include "emulator/transports/serial_bytes.hpp"
#include "emulator/transports/slcan.hpp"
#include "emulator/transports/socketcand.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;
using protocol::Frame;
using protocol::FrameKind;

constexpr ClientProtocol::Time kNow = std::chrono::seconds(1000);

void check_frame(const Frame& frame) {
  require(frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote);
  require(frame.dlc <= protocol::kCanBytes);
  require(frame.id <= (frame.extended ? protocol::kMostExtendedId : protocol::kMostStandardId));
}

struct Said {
  FromClient heard;
  std::vector<Frame> jobs;
  std::string shown;
};

Said say(ClientProtocol& client, std::span<const std::uint8_t> bytes, std::size_t slice) {
  Said said;
  while (!bytes.empty()) {
    const std::size_t size = std::min(slice, bytes.size());
    client.take(bytes.first(size), kNow, said.heard);
    bytes = bytes.subspan(size);
  }
  // Only now: whatever it has set up is in force.
  Frame frame{.id = 0x141, .dlc = 8};
  for (const FrameKind kind : {FrameKind::kData, FrameKind::kRemote, FrameKind::kError}) {
    frame.kind = kind;
    client.show(frame, kNow, said.shown);
  }
  if (const auto due = client.next_due()) {
    require(*due >= kNow);
    client.take_due(*due, said.jobs);
    require(!said.jobs.empty() && said.jobs.size() <= Socketcand::kMostJobs);
    require(*client.next_due() > *due);
  }
  return said;
}

template <class Make>
void check_protocol(std::span<const std::uint8_t> bytes, std::size_t slice, Make make) {
  const std::unique_ptr<ClientProtocol> one = make();
  const std::unique_ptr<ClientProtocol> other = make();
  const Said at_once = say(*one, bytes, std::max<std::size_t>(bytes.size(), 1));
  const Said in_slices = say(*other, bytes, slice);
  require(at_once.heard.frames == in_slices.heard.frames);
  require(at_once.heard.answer == in_slices.heard.answer);
  require(at_once.heard.malformed == in_slices.heard.malformed);
  require(at_once.jobs == in_slices.jobs);
  require(at_once.shown == in_slices.shown);
  // A byte ends one line at most, and a line has one answer.
  require(at_once.heard.frames.size() <= bytes.size());
  require(at_once.heard.answer.size() <= 32 * bytes.size());
  for (const Frame& frame : at_once.heard.frames) check_frame(frame);
  for (const Frame& frame : at_once.jobs) check_frame(frame);
}

void check_slcan(std::span<const std::uint8_t> bytes, std::size_t slice, std::int64_t bitrate) {
  check_protocol(bytes, slice, [&] { return std::make_unique<Slcan>(bitrate); });
  Slcan open(0);
  FromClient heard;
  const std::uint8_t opens[] = {'\r', 'O', '\r'};
  open.take(opens, kNow, heard);
  open.take(bytes, kNow, heard);
  for (const Frame& frame : heard.frames) {
    require(parse_slcan_frame(slcan_frame(frame)) == frame);
  }
}

void check_datagram(std::span<const std::uint8_t> bytes) {
  const auto frame = parse_can_msgpack(bytes);
  if (!frame || frame->kind == FrameKind::kFd || frame->kind == FrameKind::kError) return;
  check_frame(*frame);
  require(parse_can_msgpack(can_msgpack(*frame, kNow)) == *frame);
}

/// Where the data are cut decides what packets they are, so it is telnet alone that is sliced; and
/// what is said to a client it reads as telnet does.
void check_serial(std::span<const std::uint8_t> bytes, std::size_t slice, std::int64_t bitrate) {
  SerialBytes one(bitrate);
  SerialBytes other(bitrate);
  FromClient at_once;
  FromClient in_slices;
  one.take(bytes, kNow, at_once);
  for (auto rest = bytes; !rest.empty(); rest = rest.subspan(std::min(slice, rest.size()))) {
    other.take(rest.first(std::min(slice, rest.size())), kNow, in_slices);
  }
  require(at_once.answer == in_slices.answer);
  require(at_once.malformed == in_slices.malformed);
  require(at_once.answer.size() <= 32 * bytes.size());
  const auto on_wire = [](const FromClient& heard) {
    std::vector<std::uint8_t> all;
    for (const Frame& frame : heard.frames) {
      const auto wire = protocol::wire_bytes(frame);
      all.insert(all.end(), wire.view().begin(), wire.view().end());
    }
    return all;
  };
  const std::vector<std::uint8_t> data = on_wire(at_once);
  require(data == on_wire(in_slices));
  require(data.size() <= bytes.size());
  std::string said;
  Rfc2217::put(data, said);
  Rfc2217 reader(1);
  Rfc2217::Answer answer;
  std::vector<std::uint8_t> read;
  for (const char c : said) {
    if (const auto byte = reader.take(static_cast<std::uint8_t>(c), answer)) read.push_back(*byte);
  }
  require(read == data && answer.bytes.empty() && answer.malformed == 0);
}

void check(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const std::uint8_t settings = bytes.front();
  bytes = bytes.subspan(1);
  const std::size_t slice = 1U + (settings >> 4U);
  switch (settings & 3U) {
    case 0:
      check_slcan(bytes, slice, (settings & 4U) != 0 ? 1'000'000 : 0);
      break;
    case 1:
      if ((settings & 4U) != 0) {
        check_serial(bytes, slice, (settings & 8U) != 0 ? 1'000'000 : 0);
        break;
      }
      [[fallthrough]];
    case 2:
      check_protocol(bytes, slice, [] { return std::make_unique<Socketcand>(); });
      break;
    default:
      check_datagram(bytes);
  }
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({data, size});
  return 0;
}

// Bytes of clients: slcan, socketcand, RS-485 over TCP, and python-can datagrams.
//
// Input: a byte that selects the protocol and the slices, then the client's bytes. Slices and a
// single piece give equal results; parsed frames can be encoded again; nothing grows without bound.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "emulator/io/transports/multicast_port.hpp"
#include "emulator/io/transports/serial_port.hpp"
#include "emulator/io/transports/slcan.hpp"
#include "emulator/io/transports/socketcand.hpp"
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
  require(frame.id <= (frame.extended ? protocol::kMaxExtendedId : protocol::kMaxStandardId));
}

struct Results {
  ParsedInput parsed;
  std::vector<Frame> jobs;
  std::string shown;
};

Results talk(ClientProtocol& client, std::span<const std::uint8_t> bytes, std::size_t slice) {
  Results results;
  while (!bytes.empty()) {
    const std::size_t size = std::min(slice, bytes.size());
    client.parse(bytes.first(size), kNow, results.parsed);
    bytes = bytes.subspan(size);
  }
  // After the input, so that its settings are in effect.
  Frame frame{.id = 0x141, .dlc = 8};
  for (const FrameKind kind : {FrameKind::kData, FrameKind::kRemote, FrameKind::kError}) {
    frame.kind = kind;
    client.encode(frame, kNow, results.shown);
  }
  if (const auto due = client.next_due()) {
    require(*due >= kNow);
    client.take_due(*due, results.jobs);
    require(!results.jobs.empty() && results.jobs.size() <= Socketcand::kMaxJobs);
    require(*client.next_due() > *due);
  }
  return results;
}

template <class Make>
void check_protocol(std::span<const std::uint8_t> bytes, std::size_t slice, Make make) {
  const std::unique_ptr<ClientProtocol> one = make();
  const std::unique_ptr<ClientProtocol> other = make();
  const Results at_once = talk(*one, bytes, std::max<std::size_t>(bytes.size(), 1));
  const Results in_slices = talk(*other, bytes, slice);
  require(at_once.parsed.frames == in_slices.parsed.frames);
  require(at_once.parsed.response == in_slices.parsed.response);
  require(at_once.parsed.malformed == in_slices.parsed.malformed);
  require(at_once.jobs == in_slices.jobs);
  require(at_once.shown == in_slices.shown);
  // A byte ends at most one line, and a line has one answer.
  require(at_once.parsed.frames.size() <= bytes.size());
  require(at_once.parsed.response.size() <= 32 * bytes.size());
  for (const Frame& frame : at_once.parsed.frames) check_frame(frame);
  for (const Frame& frame : at_once.jobs) check_frame(frame);
}

void check_slcan(std::span<const std::uint8_t> bytes, std::size_t slice, std::int64_t bitrate) {
  check_protocol(bytes, slice, [&] { return std::make_unique<Slcan>(bitrate); });
  Slcan open(0);
  ParsedInput parsed;
  const std::uint8_t opens[] = {'\r', 'O', '\r'};
  open.parse(opens, kNow, parsed);
  open.parse(bytes, kNow, parsed);
  for (const Frame& frame : parsed.frames) {
    require(parse_slcan_frame(slcan_frame(frame)) == frame);
  }
}

void check_datagram(std::span<const std::uint8_t> bytes) {
  const auto frame = parse_can_msgpack(bytes);
  if (!frame || frame->kind == FrameKind::kFd || frame->kind == FrameKind::kError) return;
  check_frame(*frame);
  require(parse_can_msgpack(can_msgpack(*frame, kNow)) == *frame);
}

/// RS-485 bytes arrive unchanged in any slices.
void check_serial(std::span<const std::uint8_t> bytes, std::size_t slice) {
  SerialBytes client;
  ParsedInput parsed;
  for (auto rest = bytes; !rest.empty(); rest = rest.subspan(std::min(slice, rest.size()))) {
    client.parse(rest.first(std::min(slice, rest.size())), kNow, parsed);
  }
  require(parsed.response.empty() && parsed.malformed == 0);
  std::string arrived;
  for (const Frame& frame : parsed.frames) client.encode(frame, kNow, arrived);
  require(
      std::ranges::equal(arrived, bytes, {}, [](char c) { return static_cast<std::uint8_t>(c); }));
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
        check_serial(bytes, slice);
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

#include "emulator/advice/duplicate_watch.hpp"

#include <algorithm>
#include <cstdlib>

#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using protocol::Opcode;

// clang-format off
constexpr Words kReply{"{1} °C where a query has 0: the reply of another drive with this ID; the two answer each other's replies",
                       "命令帧该为 0 的位置是 {1} °C：这是另一台同 ID 驱动器的回复，两台驱动器会互相回复"};
constexpr Words kReadReply{"a value where a query has 0: the reply of another drive with this ID; the two answer each other's replies",
                           "命令帧该为 0 的位置有数值：这是另一台同 ID 驱动器的回复，两台驱动器会互相回复"};
// clang-format on

/// Commands whose reply has a temperature or values, and the bytes that are 0 in a query (bit n:
/// DATA[n]). With a max speed, the host chooses all bytes after DATA[1].
struct Row {
  Opcode command;
  unsigned unused;
  unsigned steady = 0;       // bytes of a reply without temperature that stay constant for 4 ms
  bool single_turn = false;  // query has a direction in DATA[1], a target in DATA[4:7]
};
constexpr unsigned kAll = 0b1111'1110;
constexpr unsigned kTemperature = 0b0000'0010;
constexpr std::array kRows = std::to_array<Row>({
    {protocol::ReadState1::kOpcode, kAll},
    {protocol::ClearErrors::kOpcode, kAll},
    {protocol::ReadState2::kOpcode, kAll},
    {protocol::ReadState3::kOpcode, kAll},
    {protocol::OpenLoop::kOpcode, 0b1100'1110},
    {protocol::Torque::kOpcode, 0b1100'1110},
    {protocol::Speed::kOpcode, 0b0000'1110},
    {protocol::Position1::kOpcode, 0b0000'1110},
    {protocol::Position2::kOpcode, kTemperature},
    {protocol::Position3::kOpcode, 0b0000'1110, 0, true},
    {protocol::Position4::kOpcode, kTemperature, 0, true},
    {protocol::Position5::kOpcode, 0b0000'1110},
    {protocol::Position6::kOpcode, kTemperature},
    {protocol::ReadPid::kOpcode, kAll, kAll},
    {protocol::ReadAcceleration::kOpcode, kAll, kAll},
    {protocol::ReadEncoder::kOpcode, kAll, 0b1100'0010},
    {protocol::ReadMultiTurnAngle::kOpcode, kAll, 0b1111'0000},
    {protocol::ReadSingleTurnAngle::kOpcode, kAll, 0b0000'1110},
});

/// Drive temperature. Not 0 or 1, which queries have, and not −1, which is a stray 0xFF.
bool is_temperature(int C) { return (C > 1 || C < -1) && C >= -40; }

bool same(const protocol::Payload& a, const protocol::Payload& b, unsigned mask) {
  for (std::size_t n = 0; n < protocol::kCanBytes; ++n) {
    if ((mask >> n & 1U) != 0 && a[n] != b[n]) return false;
  }
  return true;
}

int temperature_C(const protocol::Payload& data) { return static_cast<std::int8_t>(data[1]); }

/// Returns true for a frame as sent by a host that clears its buffer.
bool is_clear(const protocol::Payload& data, const Row& row) {
  if (row.steady != 0) return same(data, {}, kAll);
  return data[1] == 0 || data[1] == 1;
}

/// DATA[7] is 0 or 0xFF in a target within one turn of any output, or a negative one. Replies have
/// the high byte of the encoder there.
bool ends_as_target(const protocol::Payload& data) { return data[7] == 0 || data[7] == 0xFF; }

bool may_be_reply(const protocol::Payload& data, const Row& row) {
  if (row.single_turn && ends_as_target(data)) return false;
  return row.steady != 0 ? !is_clear(data, row) : is_temperature(temperature_C(data));
}

}  // namespace

bool RecentFrames::have(const protocol::Payload& data, unsigned mask) const {
  return std::ranges::any_of(kept_,
                             [&](const protocol::Payload& kept) { return same(kept, data, mask); });
}

int DuplicateWatch::Streak::add(const TimedFrame& in, bool alike) {
  times = alike && in.at - at <= kApart ? std::min(times + 1, kTimes) : 1;
  at = in.at;
  data = in.frame.data;
  return times;
}

std::optional<Finding> DuplicateWatch::hear(const TimedFrame& in, const RecentFrames& recent) {
  const protocol::Payload& data = in.frame.data;
  const auto row = std::ranges::find(kRows, static_cast<Opcode>(data[0]), &Row::command);
  if (row == kRows.end()) return std::nullopt;
  const std::uint32_t bit = 1U << (row - kRows.begin());
  if (is_clear(data, *row)) asked_ |= bit;
  if (!may_be_reply(data, *row) || (asked_ & bit) == 0 || recent.have(data, row->unused)) {
    return std::nullopt;
  }
  if (row->steady != 0) {
    const bool alike = data[0] == reads_.data[0] && same(data, reads_.data, row->steady);
    if (reads_.add(in, alike) < kTimes) return std::nullopt;
    return Finding{AdviceKind::kDuplicateId, &kReadReply};
  }
  const int now_C = temperature_C(data);
  const bool alike = std::abs(now_C - temperature_C(warm_.data)) <= kSteady_C;
  if (warm_.add(in, alike) < kTimes) return std::nullopt;
  return Finding{AdviceKind::kDuplicateId, &kReply, {static_cast<double>(now_C)}};
}

}  // namespace lk::emulator

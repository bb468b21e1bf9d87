#include "emulator/advice/duplicate_watch.hpp"

#include <algorithm>
#include <cstdlib>

#include "protocol/opcodes.hpp"

namespace lk::emulator {
namespace {

using protocol::Opcode;

// clang-format off
constexpr Words kReply{"{1} °C where a query has 0: the reply of another drive with this ID; the two answer each other's replies",
                       "命令帧该为 0 的位置是 {1} °C：这是另一台同 ID 驱动器的回复，两台驱动器会互相回复"};
// clang-format on

/// Commands whose reply has a temperature in DATA[1], and the bytes that their queries leave 0, bit
/// n for DATA[n]. Not those with a max speed: what follows DATA[1] is all the host's to choose.
struct Row {
  Opcode command;
  unsigned unused;
};
constexpr std::array kRows = std::to_array<Row>({
    {Opcode::kReadState1, 0b1111'1110},
    {Opcode::kClearErrors, 0b1111'1110},
    {Opcode::kReadState2, 0b1111'1110},
    {Opcode::kReadState3, 0b1111'1110},
    {Opcode::kOpenLoop, 0b1100'1110},
    {Opcode::kTorque, 0b1100'1110},
    {Opcode::kSpeed, 0b0000'1110},
    {Opcode::kPosition1, 0b0000'1110},
    {Opcode::kPosition3, 0b0000'1110},
    {Opcode::kPosition5, 0b0000'1110},
});

}  // namespace

bool RecentFrames::have(const protocol::Payload& data, unsigned mask) const {
  return std::ranges::any_of(kept_, [&](const protocol::Payload& kept) {
    for (std::size_t n = 0; n < data.size(); ++n) {
      if ((mask >> n & 1U) != 0 && kept[n] != data[n]) return false;
    }
    return true;
  });
}

std::optional<Finding> DuplicateWatch::hear(const TimedFrame& in, const RecentFrames& recent) {
  const protocol::Payload& data = in.frame.data;
  const auto row = std::ranges::find(kRows, static_cast<Opcode>(data[0]), &Row::command);
  if (row == kRows.end()) return std::nullopt;
  const std::uint32_t bit = 1U << (row - kRows.begin());
  const auto temperature_C = static_cast<std::int8_t>(data[1]);
  if (temperature_C == 0 || temperature_C == 1) asked_ |= bit;
  if (temperature_C <= 1 || (asked_ & bit) == 0 || recent.have(data, row->unused)) {
    return std::nullopt;
  }
  const bool again =
      in.at - last_ <= kApart && std::abs(temperature_C - temperature_C_) <= kSteady_C;
  times_ = again ? std::min(times_ + 1, kTimes) : 1;
  last_ = in.at;
  temperature_C_ = temperature_C;
  if (times_ < kTimes) return std::nullopt;
  return Finding{AdviceKind::kDuplicateId, &kReply, {static_cast<double>(temperature_C)}};
}

}  // namespace lk::emulator

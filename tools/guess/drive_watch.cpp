#include "tools/guess/drive_watch.hpp"

#include <algorithm>
#include <cstdlib>

#include "emulator/monitor/frames/log_pairing.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {
namespace {

using protocol::get_le;
using protocol::Opcode;
using protocol::Payload;
using namespace std::chrono_literals;

// Limits for motors that LK-TECH sells (assumed). Values beyond these limits mean another layout.
constexpr double kLeastVoltage_V = 7;
constexpr double kMaxVoltage_V = 60;
constexpr int kColdest_C = -40;
constexpr int kMaxBusCurrent_lsb = 10000;  // 100 A
constexpr std::uint32_t kMaxSingleTurn_cdeg = 36000 * 100;
constexpr std::uint32_t kTurn_cdeg = 36000;
constexpr std::uint16_t kMost14Bits = 16'383;
constexpr int kWrap = 12'288;  // least change at a wrap-around of 14 bits; assumed
constexpr std::uint8_t kUnderOrOverVoltage = 0x03;
constexpr std::uint8_t kLegacyErrors = 0x09;
constexpr std::uint8_t kBridgeOff = 0x10;
constexpr std::uint16_t kDeviceOfMs = 0x2011;  // docs/reference/rs485.md

/// Silence counts only if the drive answered within this time before and after (assumed).
constexpr SimTime kSilenceWindow = 10s;
/// A drive is still off within this time after its reply to 0x80 (assumed).
constexpr SimTime kOffWindow = 1s;
constexpr std::uint64_t kEnoughTimed = 3;

bool plausible(double voltage_V) {
  return voltage_V >= kLeastVoltage_V && voltage_V <= kMaxVoltage_V;
}

/// Returns the layouts that a reply to 0x9A can have. Bit n of the set is State1Layout n.
ValueSet state_1_layouts(const Payload& data) {
  const bool deci = (data[2] | data[5] | data[6]) == 0;
  const bool centi = (data[4] | data[5] | data[6]) == 0;
  const int current_lsb = get_le<std::int16_t>(data, 4);
  const bool with_current = (data[6] & 0xCFU) == 0 && std::abs(current_lsb) <= kMaxBusCurrent_lsb;
  // With a voltage error any voltage is plausible, so only the zero bytes decide.
  const bool any_voltage = (data[7] & kUnderOrOverVoltage) != 0;
  const bool deci_V = any_voltage || plausible(get_le<std::uint16_t>(data, 3) * 0.1);
  const bool centi_V = any_voltage || plausible(get_le<std::uint16_t>(data, 2) * 0.01);
  ValueSet layouts = 0;
  if (deci && deci_V) layouts |= only(0);
  if (centi && centi_V) layouts |= only(1);
  if (with_current && centi_V) layouts |= only(2);
  return layouts;
}

bool is_state_2(std::uint8_t command) {
  return command == static_cast<std::uint8_t>(protocol::ReadState2::kOpcode) ||
         (command >= static_cast<std::uint8_t>(protocol::OpenLoop::kOpcode) &&
          command <= static_cast<std::uint8_t>(protocol::Position6::kOpcode));
}

std::optional<Trait> trait_of(std::uint32_t asked, protocol::Framing framing) {
  if (asked > 0xFF) return std::nullopt;
  return trait_of_command(static_cast<Opcode>(asked), framing);
}

/// Returns the values of the trait that are possible if the drive answers a command of the trait
/// (`answered`), or does not.
ValueSet allowed_by(Trait trait, bool answered) {
  if (trait == Trait::kSeries) return only(answered ? kNotMs : kMs);
  return only(answered ? kSwitchedOn : kSwitchedOff);
}

/// Conclusion from the reply to a query, or from lasting silence after the query. For some queries,
/// the conclusion depends on LEN.
struct Says {
  Trait trait;
  ValueSet allowed;
};
std::optional<Says> says(const QueryOutcome& settled, bool answered) {
  const auto framing = protocol::framing_of(settled.query);
  const auto trait = trait_of(settled.query_code, framing);
  const int len = settled.query.dlc - 1;
  const bool serial = framing == protocol::Framing::kSerial;
  if (serial && settled.query_code == static_cast<std::uint8_t>(protocol::Speed::kOpcode) &&
      len == 6) {
    return Says{Trait::kSpeedLimit, allowed_by(Trait::kSpeedLimit, answered)};
  }
  if (!trait) return std::nullopt;
  if (*trait == Trait::kEncoderForm) {  // drives may accept the LEN of the other form
    return Says{*trait, answered ? ValueSet{0} : only(len == 0 ? kSwitchedOn : kSwitchedOff)};
  }
  // A drive with the command may ignore a wrong LEN.
  if (*trait == Trait::kZeroRam && !answered && len != 0) return Says{*trait, ValueSet{0}};
  if (*trait == Trait::kProduct && answered) return Says{*trait, ValueSet{0}};  // by LEN of reply
  return Says{*trait, allowed_by(*trait, answered)};
}

bool in_order(const std::optional<SimTime>& a, const std::optional<SimTime>& b, SimTime most) {
  return !a || !b || (*b >= *a && *b - *a <= most);
}

}  // namespace

void DriveWatch::query(const FrameInfo& info, std::optional<SimTime> at) {
  ++queries_;
  const Sighting sighting{info.frame, at};
  if (protocol::is_serial(info.frame)) evidence_.on_serial();
  const bool several = protocol::find_multi_drive(info.frame.id) != nullptr;
  if (several) {
    const bool counts = several_known_ && (info.frame.id == protocol::MultiSpeed::kIdentifier ||
                                           info.frame.id == protocol::MultiPosition::kIdentifier);
    if (counts) {
      ++several_.silent;
      if (several_.first.empty()) several_.first.push_back(sighting);
    }
  } else if (info.frame.data[0] == static_cast<std::uint8_t>(protocol::Run::kOpcode) ||
             info.frame.data[0] == static_cast<std::uint8_t>(protocol::ClearErrors::kOpcode)) {
    off_at_.reset();
  }
  if (!protocol::is_serial(info.frame)) motion_.query(sighting);
}

void DriveWatch::settle(const QueryOutcome& settled) {
  if (settled.how == QueryOutcome::How::kOpen) return;
  const bool answered = settled.how == QueryOutcome::How::kAnswered;
  const auto says_so = says(settled, answered);
  if (!says_so && settled.query_code <= 0xFF) evidence_.count_answer(answered);
  if (answered) {
    if (answered_before_ && in_order(answered_at_, silent_since_, kSilenceWindow) &&
        in_order(silent_since_, settled.at, kSilenceWindow)) {
      for (const auto& [behind, frames] : silent_) {
        evidence_.see(behind.first, behind.second, frames);
      }
    }
    // Here the LEN of the query decides, which the reply does not show.
    if (says_so && says_so->trait == Trait::kSpeedLimit) {
      evidence_.see(says_so->trait, says_so->allowed, Weight::kSure, {settled.query, settled.at});
    }
    silent_.clear();
    silent_since_.reset();
    answered_before_ = true;
    answered_at_ = settled.at;
  } else if (says_so) {
    Frames& frames = silent_[{says_so->trait, says_so->allowed}];
    ++frames.silent;
    if (frames.first.size() < Evidence::kMaxExamples) {
      frames.first.push_back({settled.query, settled.at});
    }
    if (!silent_since_) silent_since_ = settled.at;
  } else {
    // The drive seems to be absent: its silence proves nothing about other commands.
    silent_.clear();
    silent_since_.reset();
    answered_before_ = false;
  }
}

/// Returns true if the latency of the reply is usual for this drive. If not, the frame may be a
/// repeated query.
bool DriveWatch::paced(const FrameInfo& info) const {
  if (!info.latency || timed_ < kEnoughTimed) return false;
  return *info.latency * 5 >= fastest_ * 4 && *info.latency * 2 <= slowest_ * 3;
}

void DriveWatch::reply(const FrameInfo& info, const protocol::Frame& raw,
                       std::optional<SimTime> at) {
  ++replies_;
  const Sighting sighting{raw, at};
  const std::uint8_t command = info.frame.data[0];
  const bool fits = info.match_count > 0;
  const bool serial = protocol::is_serial(raw);
  if (serial) evidence_.on_serial();
  if (info.sure && fits) {
    const std::uint32_t base = raw.id - static_cast<std::uint32_t>(info.drive);
    const auto value = static_cast<std::size_t>(std::ranges::find(protocol::kReplyIdBases, base) -
                                                protocol::kReplyIdBases.begin());
    if (!serial) evidence_.see(Trait::kReplyId, only(value), Weight::kLikely, sighting);
    // Latencies exclude the brake, whose reply looks like another command, and slow writes to ROM.
    const auto* const row = protocol::command_of(info.frame);
    const bool usual =
        row != nullptr && !row->writes_rom && row->opcode != protocol::Brake::kOpcode;
    if (usual && info.latency && *info.latency > SimTime{0}) {
      fastest_ = timed_ == 0 ? *info.latency : std::min(fastest_, *info.latency);
      slowest_ = std::max(slowest_, *info.latency);
      ++timed_;
    }
  }
  if (info.match_count == 1) see_answer(info, sighting);
  if (command == static_cast<std::uint8_t>(protocol::ReadState1::kOpcode) ||
      command == static_cast<std::uint8_t>(protocol::ClearErrors::kOpcode)) {
    see_state_1(sighting);
  }
  if (!serial && command == static_cast<std::uint8_t>(protocol::ReadSingleTurnAngle::kOpcode)) {
    see_single_turn(sighting);
  }
  if (!serial && command == static_cast<std::uint8_t>(protocol::WriteZeroToRom::kOpcode)) {
    see_zero(sighting);
  }
  if (command == static_cast<std::uint8_t>(protocol::Off::kOpcode)) off_at_ = at;
  if (serial && fits) see_packet(info, sighting);
  see_encoder({info.frame, at});
  const int effort_lsb = get_le<std::int16_t>(info.frame.data, 2);
  if (is_state_2(command) && std::abs(effort_lsb) > protocol::kIqReplyLimit_lsb) ++odd_currents_;
  if (!serial) motion_.reply({info.frame, at}, evidence_);
}

/// Uses replies to 0x92 only: with angle 0, as right after 0x95, they have the bytes of the query.
void DriveWatch::unclear(const FrameInfo& info, std::optional<SimTime> at) {
  const bool angle =
      info.frame.data[0] == static_cast<std::uint8_t>(protocol::ReadMultiTurnAngle::kOpcode);
  if (angle && paced(info) && !protocol::is_serial(info.frame))
    motion_.reply({info.frame, at}, evidence_);
}

/// Collects evidence from the fact that the drive replied, and from DATA[0] of the reply.
void DriveWatch::see_answer(const FrameInfo& info, const Sighting& sighting) {
  const bool serial = protocol::is_serial(sighting.frame);
  if (info.query_code > 0xFF) {
    if (serial) return;
    see_multi_drive(info, sighting);
    return;
  }
  const auto* const command = protocol::find_command(static_cast<std::uint8_t>(info.query_code));
  if (!serial && info.sure && command != nullptr && command->printed != Opcode{}) {
    const bool repeats = info.frame.data[0] == info.query_code;
    evidence_.see(Trait::kReplyBytes, only(repeats ? kSwitchedOff : kSwitchedOn), Weight::kLikely,
                  sighting);
  }
  const auto trait = trait_of(info.query_code, protocol::framing_of(sighting.frame));
  if (!trait || *trait == Trait::kEncoderForm || *trait == Trait::kProduct) return;  // see_packet
  // A reply with the brake's state has the bytes of a brake command, so it is never sure.
  const bool sure = info.sure && *trait != Trait::kBrake;
  const Weight weight = sure ? Weight::kSure : paced(info) ? Weight::kLikely : Weight::kHint;
  evidence_.see(*trait, allowed_by(*trait, true), weight, sighting);
  if (info.sure && *trait == Trait::kOpenLoop) {
    evidence_.see(Trait::kSeries, only(kMs), Weight::kSure, sighting);
  }
}

/// Collects evidence from the length and contents of an RS-485 packet.
void DriveWatch::see_packet(const FrameInfo& info, const Sighting& sighting) {
  const protocol::Frame& frame = sighting.frame;
  const int len = frame.dlc - 1;
  const auto is = [&](Opcode opcode) { return static_cast<Opcode>(frame.data[0]) == opcode; };
  const Weight weight = info.sure ? Weight::kSure : Weight::kLikely;
  const auto see_series = [&](bool ms) {
    evidence_.see(Trait::kSeries, only(ms ? kMs : kNotMs), weight, sighting);
  };
  if (is(protocol::ReadEncoder::kOpcode)) {
    evidence_.see(Trait::kEncoderForm, only(len == 6 ? kSwitchedOff : kSwitchedOn), weight,
                  sighting);
  } else if (is(protocol::WriteZeroToRom::kOpcode)) {
    evidence_.see(Trait::kZeroReply, only(len == 2 ? kNarrow : kWide), weight, sighting);
  } else if (is(protocol::ClearAngle::kOpcode) && len == 7) {
    evidence_.see(Trait::kZeroRamLen, only(kSwitchedOn), Weight::kLikely, sighting);
  } else if (is(protocol::ReadDeviceType::kOpcode)) {
    see_series(get_le<std::uint16_t>(frame.data, 1) == kDeviceOfMs);
  } else if (const auto product = product_info(frame)) {
    evidence_.see(Trait::kProduct, only(len == 42 ? kShortProduct : kLongProduct), weight,
                  sighting);
    evidence_.set_product(*product);
    for (const char* const series : protocol::kSeriesNames) {
      if (product->motor.starts_with(series)) see_series(std::string_view(series) == "MS");
    }
  }
}

void DriveWatch::see_field(std::uint16_t counts, std::optional<int> speed_dps,
                           const Sighting& sighting) {
  const auto before = encoder_.last();
  encoder_.field(counts, speed_dps, sighting.at);
  const int change = before ? counts - *before : 0;
  // A large change against the direction of the speed is a wrap-around.
  const bool wrap =
      std::abs(change) > kWrap && speed_dps && *speed_dps != 0 && (change > 0) != (*speed_dps > 0);
  if (counts > kMost14Bits) {
    evidence_.see(Trait::kEncoderBits, only(k16Bits), Weight::kSure, sighting);
  } else if (wrap && encoder_.largest() <= kMost14Bits) {
    evidence_.see(Trait::kEncoderBits, only(k14Bits), Weight::kLikely, sighting);
  }
}

void DriveWatch::see_encoder(const Sighting& sighting) {
  const auto& data = sighting.frame.data;
  const bool serial = protocol::is_serial(sighting.frame);
  const auto command = static_cast<Opcode>(data[0]);
  if (is_state_2(data[0])) {
    see_field(get_le<std::uint16_t>(data, 6), get_le<std::int16_t>(data, 4), sighting);
  } else if (command == protocol::ReadEncoder::kOpcode) {
    // Skips the longer form: it has all bits of the position, other replies may have fewer.
    const bool in_full = serial && sighting.frame.dlc > 7;
    const std::size_t place = serial ? 1 : 2;
    if (!in_full) see_field(get_le<std::uint16_t>(data, place), std::nullopt, sighting);
  } else if (command == protocol::ReadMultiTurnAngle::kOpcode) {
    const std::int64_t angle_cdeg =
        serial ? get_le<std::int64_t>(data, 1) : protocol::get_le56(data);
    const auto turn = encoder_.angle(angle_cdeg, sighting.at);
    if (!turn) return;
    const bool rotor = turn->span == EncoderSpan::kRotorTurn;
    evidence_.see(Trait::kEncoderSpan, only(rotor ? kRotorTurn : kOutputTurn), Weight::kLikely,
                  sighting);
    if (turn->counts == kMost14Bits + 1 || turn->counts > 2 * (kMost14Bits + 1)) {
      evidence_.see(Trait::kEncoderBits, only(turn->counts > kMost14Bits + 1 ? k16Bits : k14Bits),
                    Weight::kLikely, sighting);
    }
  }
}

void DriveWatch::see_multi_drive(const FrameInfo& info, const Sighting& sighting) {
  if (info.query_code == protocol::MultiTorque::kIdentifier) {
    evidence_.see(Trait::kSeries, only(kNotMs), Weight::kLikely, sighting);
    evidence_.see(Trait::kSeveral, only(kSwitchedOff), several_);
    several_known_ = true;
  } else {
    evidence_.see(Trait::kSeveral, only(kSwitchedOn), Weight::kLikely, sighting);
  }
  several_ = {};
}

void DriveWatch::see_state_1(const Sighting& sighting) {
  const protocol::Payload& data = sighting.frame.data;
  if (static_cast<std::int8_t>(data[1]) < kColdest_C) return;
  ValueSet layouts = state_1_layouts(data);
  if (layouts == 0) {
    ++odd_states_;
    return;
  }
  evidence_.see(Trait::kState1, layouts, Weight::kSure, sighting);
  if ((data[7] & ~kLegacyErrors) != 0) {
    evidence_.see(Trait::kErrorBits, only(kSwitchedOn), Weight::kSure, sighting);
  }
  // In the layout with bus current, byte 6 shows that the drive is off.
  const auto with_current =
      static_cast<std::size_t>(protocol::State1Layout::kCentiVoltAndBusCurrent);
  const bool off = off_at_ && in_order(off_at_, sighting.at, kOffWindow) && sighting.at;
  if (off && data[6] != kBridgeOff && contains(layouts, with_current)) {
    layouts &= static_cast<ValueSet>(~only(with_current));
    evidence_.see(Trait::kState1, layouts, Weight::kLikely, sighting);
    off_at_.reset();
  }
}

/// Collects evidence from a reply to 0x19 whose offset has bits that only one layout can have.
void DriveWatch::see_zero(const Sighting& sighting) {
  const protocol::Payload& data = sighting.frame.data;
  ValueSet widths = 0;
  if ((data[4] | data[5]) == 0) widths |= only(kNarrow);
  if ((data[6] | data[7]) == 0) widths |= only(kWide);
  if (widths != 0) evidence_.see(Trait::kZeroReply, widths, Weight::kSure, sighting);
}

void DriveWatch::see_single_turn(const Sighting& sighting) {
  const protocol::Payload& data = sighting.frame.data;
  const auto wide_cdeg = get_le<std::uint32_t>(data, 4);
  const auto narrow_cdeg = get_le<std::uint16_t>(data, 6);
  if (wide_cdeg == 0 || (data[1] | data[2] | data[3]) != 0) return;
  ValueSet widths = 0;
  if ((data[4] | data[5]) == 0 && narrow_cdeg < kTurn_cdeg) widths |= only(kNarrow);
  if (wide_cdeg < kMaxSingleTurn_cdeg) widths |= only(kWide);
  evidence_.see(Trait::kSingleTurn, widths, Weight::kSure, sighting);
  if (widths == only(kWide) && wide_cdeg >= kTurn_cdeg) {
    evidence_.see(Trait::kEncoderSpan, only(kOutputTurn), Weight::kSure, sighting);
  }
}

}  // namespace lk::emulator

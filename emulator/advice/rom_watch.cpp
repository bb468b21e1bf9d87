#include "emulator/advice/rom_watch.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

constexpr Words kWearsOut{
    "written {1} times by this host: at this rate the {2} writes that are left in ROM last {3} h",
    "这台主机已写 {1} 次：照此速度，ROM 剩余的 {2} 次擦写只够用 {3} 小时"};
constexpr Words kWornOut{
    "written {1} times by this host: ROM has had all the writes that it is made for",
    "这台主机已写 {1} 次：ROM 的擦写寿命已经用完"};

}  // namespace

std::optional<Finding> RomWatch::hear(const Heard& heard, const KnownDrive& drive) {
  const bool gains = heard.is<protocol::WritePidToRom>();
  if (!gains && !heard.is<protocol::WriteOffsetToRom>() && !heard.is<protocol::WriteZeroToRom>()) {
    return std::nullopt;
  }
  Writes& writes = gains ? gains_ : offset_;
  writes.at[writes.count % kWrites] = heard.at;
  ++writes.count;
  if (writes.count < kWrites) return std::nullopt;
  const auto parameter = gains ? RomParameter::kGains : RomParameter::kEncoderOffset;
  const std::uint32_t written = drive.wear[static_cast<std::size_t>(parameter)];
  const auto count = static_cast<double>(writes.count);
  if (written >= drive.endurance) {
    return Finding{AdviceKind::kRomWear, &kWornOut, {count}, true};
  }
  const double left = drive.endurance - written;
  const SimTime oldest = writes.at[writes.count % kWrites];
  const std::chrono::duration<double> each = (heard.at - oldest) / double{kWrites - 1};
  const std::chrono::duration<double, std::ratio<3600>> life = each * left;
  if (life >= kLongLife) return std::nullopt;
  return Finding{AdviceKind::kRomWear, &kWearsOut, {count, left, life.count()}, true};
}

}  // namespace lk::emulator

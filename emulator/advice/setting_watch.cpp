#include "emulator/advice/setting_watch.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint8_t kRestartByte = 0x07;
constexpr std::uint8_t kWriteSetting = 0x42;
constexpr std::uint8_t kSaveSettings = 0x44;
constexpr std::uint8_t kReadParameterByte = 0xC0;
constexpr std::uint8_t kWriteParameterByte = 0xC1;
constexpr std::uint8_t kDriveSettings = 0x05;
constexpr std::uint8_t kSaved = 0x01;

// clang-format off
constexpr Words kNotSaved{"a setting was written with 0x42 and not saved with 0x44 before the restart: it is lost",
                          "用 0x42 写入的设置在重启之前没有用 0x44 保存：已经丢失"};
constexpr Words kParameterAsSetting{"0x42 with the number {1}, which is one of 0xC0 and 0xC1",
                                    "0x42 带编号 {1}，这是 0xC0 和 0xC1 的编号"};
constexpr Words kSettingAsParameter{"{command} with the number {1}, which is one of 0x40 and 0x42",
                                    "{command} 带编号 {1}，这是 0x40 和 0x42 的编号"};
// clang-format on

bool within(std::uint8_t byte, int first, int last) { return byte >= first && byte <= last; }

}  // namespace

std::optional<Finding> mixed_up_tables(const protocol::Payload& data) {
  const std::uint8_t number = data[1];
  const auto found = [&](const Words& what) {
    Finding finding{AdviceKind::kParameterSpace, &what, {static_cast<double>(number)}};
    finding.command = data[0];
    return finding;
  };
  if (data[0] == kWriteSetting && (within(number, 0x0A, 0x0C) || within(number, 0x1E, 0x26))) {
    return found(kParameterAsSetting);
  }
  if ((data[0] == kReadParameterByte || data[0] == kWriteParameterByte) &&
      (number == kDriveSettings || within(number, 0x96, 0x9E) || within(number, 0xE0, 0xEC))) {
    return found(kSettingAsParameter);
  }
  return std::nullopt;
}

std::vector<Finding> SettingWatch::hear(const protocol::Payload& data, const KnownDrive& drive) {
  std::vector<Finding> found;
  if (const auto mixed = mixed_up_tables(data)) found.push_back(*mixed);
  start_ = drive.starts;
  const bool restarts = data[0] == kRestartByte || pending_start_ != drive.starts;
  if (pending_ && restarts) {
    pending_ = false;
    found.push_back(Finding{AdviceKind::kSettingNotSaved, &kNotSaved});
  }
  return found;
}

void SettingWatch::hear_reply(const protocol::Payload& data) {
  if (data[0] == kWriteSetting) {
    pending_ = true;
    pending_start_ = start_;
  } else if (data[0] == kSaveSettings && data[2] == kSaved) {
    pending_ = false;
  }
}

}  // namespace lk::emulator

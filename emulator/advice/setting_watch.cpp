#include "emulator/advice/setting_watch.hpp"

#include <algorithm>
#include <utility>

namespace lk::emulator {
namespace {

constexpr std::uint8_t kRestartByte = 0x07;
constexpr std::uint8_t kWriteSetting = 0x42;
constexpr std::uint8_t kSaveSettings = 0x44;
constexpr std::uint8_t kReadParameterByte = 0xC0;
constexpr std::uint8_t kWriteParameterByte = 0xC1;
constexpr std::uint8_t kDriveSettings = 0x05;
constexpr std::uint8_t kDriveId = 0x0A;
constexpr std::uint8_t kSaved = 0x01;

// clang-format off
constexpr Words kNotSaved{"a setting was written with 0x42 and not saved with 0x44 before the restart: it is lost",
                          "用 0x42 写入的设置在重启之前没有用 0x44 保存：已经丢失"};
constexpr Words kNoReply{"0x07 again {1} s after the one before: the drive is restarting and has no reply to it",
                         "上一条 0x07 之后 {1} s 又发 0x07：驱动器正在重启，这条命令没有回复"};
constexpr Words kOtherPlace{"the drive was given ID {1} and has restarted; after {2} s nobody has asked there",
                            "驱动器的 ID 已改为 {1} 并已重启；{2} s 后还没有主机在那里询问"};
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

std::vector<Finding> SettingWatch::hear(SimTime at, const protocol::Payload& data,
                                        const KnownDrive& drive) {
  std::vector<Finding> found;
  const auto add = [&found](const std::optional<Finding>& one) {
    if (one) found.push_back(*one);
  };
  add(mixed_up_tables(data));
  const bool restarts = data[0] == kRestartByte;
  if (!moved_) old_id_ = drive.address;
  if (moved_ && new_id_ == drive.address) {  // it is asked where it is now
    moved_.reset();
    new_id_.reset();
  }
  start_ = drive.starts;
  const bool started = pending_start_ != drive.starts;
  if (pending_ && (restarts || started)) {
    pending_ = false;
    if (!saved_id_) new_id_.reset();
    add(Finding{AdviceKind::kSettingNotSaved, &kNotSaved});
  }
  if (new_id_ && saved_id_ && !moved_ && (restarts || started)) moved_ = at;
  if (restarts) add(hear_restart(at, drive));
  if (!restarts) add(lost_place(at));
  return found;
}

std::optional<Finding> SettingWatch::hear_restart(SimTime at, const KnownDrive& drive) {
  const std::optional<SimTime> before = std::exchange(restarted_, at);
  const std::uint32_t start_before = std::exchange(restarted_start_, drive.starts);
  // Of a drive that does not have the command nothing happens.
  const bool restarting = !drive.alive || drive.starts != start_before;
  if (!before || at - *before > kRestart || !restarting) return std::nullopt;
  return Finding{AdviceKind::kRestartAwaited, &kNoReply, {in_s(at - *before)}};
}

/// A query to where the drive was.
std::optional<Finding> SettingWatch::lost_place(SimTime at) {
  if (!moved_ || *new_id_ == old_id_) return std::nullopt;
  old_place_ = std::min(old_place_ + 1, kOldPlace);
  if (old_place_ < kOldPlace && at - *moved_ < kScan) return std::nullopt;
  const Finding found{AdviceKind::kIdSetNotScanned,
                      &kOtherPlace,
                      {static_cast<double>(*new_id_), in_s(at - *moved_)}};
  moved_.reset();
  new_id_.reset();
  return found;
}

void SettingWatch::hear_reply(const protocol::Payload& data) {
  if (data[0] == kWriteSetting) {
    pending_ = true;
    pending_start_ = start_;
    saved_id_ = false;
    if (data[1] == kDriveSettings && data[2] == kDriveId) {
      new_id_ = data[4];
      moved_.reset();
      old_place_ = 0;
    }
  } else if (data[0] == kSaveSettings && data[2] == kSaved) {
    pending_ = false;
    saved_id_ = new_id_.has_value();
  }
}

std::optional<Finding> SettingWatch::hear_elsewhere(SimTime at, int id, const KnownDrive& drive) {
  if (new_id_ && saved_id_ && !moved_ && drive.starts != pending_start_) moved_ = at;
  if (moved_ && id == old_id_) return lost_place(at);
  if (moved_ && new_id_ == id) {
    moved_.reset();
    new_id_.reset();
  }
  return std::nullopt;
}

}  // namespace lk::emulator

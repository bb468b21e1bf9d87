#include "emulator/monitor/frames/decode_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "protocol/command_info.hpp"
#include "protocol/quantities.hpp"

namespace lk::emulator {
namespace {

constexpr BilingualText kWords[] = {
    // topics of error frames, in the order of the bits CAN_ERR_TX_TIMEOUT to CAN_ERR_RESTARTED of
    // linux/can/error.h
    {"transmission timed out", "发送超时"},
    {"arbitration lost", "仲裁失败"},
    {"controller", "控制器"},
    {"protocol violation", "协议错误"},
    {"transceiver", "收发器"},
    {"no acknowledgement", "无应答"},
    {"bus-off", "总线关闭"},
    {"bus error", "总线错误"},
    {"controller restarted", "控制器重启"},
    // reasons why a frame is invalid
    {"error frame", "错误帧"},
    {"CAN FD", "CAN FD 帧"},
    {"remote request", "远程帧"},
    {"29-bit identifier", "29 位标识符"},
    {"no drive's identifier", "不是驱动器的标识符"},
    {"wrong length", "长度不对"},
    {"unknown command", "未知命令"},
    {"no reply of this drive", "不是该驱动器的回复"},
    {"no packet", "不是数据包"},
    // bits of errorState
    {"under_voltage", "欠压"},
    {"over_voltage", "过压"},
    {"driver_temperature", "驱动过温"},
    {"motor_temperature", "电机过温"},
    {"over_current", "过流"},
    {"short_circuit", "短路"},
    {"stall", "堵转"},
    {"lost_input", "输入丢失"},
};
constexpr std::size_t kErrorClasses = 9;

/// Name of a value of a field.
struct Choice {
  std::string_view key;
  int value;
  BilingualText words;
  int more = 0;  // number of following values with the same name
};

constexpr Choice kChoices[] = {
    {"action", 0x00, {"engage", "抱紧"}},
    {"action", 0x01, {"release", "释放"}},
    {"action", 0x10, {"read", "读取"}},
    {"direction", 0, {"clockwise", "顺时针"}},
    {"direction", 1, {"counter-clockwise", "逆时针"}},
    {"coil_powered", 0, {"coil unpowered", "线圈断电"}},
    {"coil_powered", 1, {"coil powered", "线圈通电"}},
    {"bridge_on", 0, {"off", "关闭"}},
    {"bridge_on", 1, {"on", "开启"}},
    {"parameter", 0x0A, {"gains of the angle loop", "角度环增益"}},
    {"parameter", 0x0B, {"gains of the speed loop", "速度环增益"}},
    {"parameter", 0x0C, {"gains of the current loop", "电流环增益"}},
    {"parameter", 0x1E, {"0x1E", "0x1E"}},
    {"parameter", 0x20, {"0x20", "0x20"}},
    {"parameter", 0x22, {"0x22", "0x22"}},
    {"parameter", 0x24, {"0x24", "0x24"}},
    {"parameter", 0x26, {"0x26", "0x26"}},
    {"parameter", 0x05, {"setting", "设置"}},
    {"parameter", 0xA0, {"stored gains of the angle loop", "存储的角度环增益"}},
    {"parameter", 0xA4, {"stored gains of the speed loop", "存储的速度环增益"}},
    {"parameter", 0xA8, {"stored gains of the current loop", "存储的电流环增益"}},
    {"parameter", 0x96, {"stored gains of the angle loop", "存储的角度环增益"}},
    {"parameter", 0x97, {"stored gains of the speed loop", "存储的速度环增益"}},
    {"parameter", 0x98, {"stored gains of the current loop", "存储的电流环增益"}},
    {"parameter", 0x99, {"setting", "设置"}, 5},
    {"device_type", 0x2011, {"MS", "MS"}},
    {"device_type", 0x2021, {"MF", "MF"}},
    {"device_type", 0x2031, {"MG", "MG"}},
    {"device_type", 0x2032, {"MG with reducer encoder", "MG，带减速端编码器"}},
    {"device_type", 0x2041, {"MH", "MH"}},
    {"refused", 0, {"done", "完成"}},
    {"refused", 1, {"refused", "被拒绝"}},
    {"item", 0x0A, {"of the ID", "：ID"}},
    {"item", 0x0B, {"of the bus", "：总线"}},
    {"item", 0x0C, {"of the rate on RS-485", "：RS-485 波特率"}},
    {"item", 0x0D, {"of the rate on CAN", "：CAN 波特率"}},
    {"item", 0xE0, {"of Max Torque Current or Power", "：最大转矩电流或功率"}},
    {"item", 0xE2, {"of Max Speed", "：最大速度"}},
    {"item", 0xE4, {"of Max Angle", "：最大角度"}},
    {"item", 0xEA, {"of the current ramp", "：电流斜坡"}},
    {"item", 0xEC, {"of the speed ramp", "：速度斜坡"}},
    {"item", 0xFA, {"save", "保存"}},
    {"bus_type", 0, {"no bus", "无总线"}},
    {"bus_type", 1, {"RS-485", "RS-485"}},
    {"bus_type", 2, {"CAN", "CAN"}},
    {"saved", 0, {"not saved", "未保存"}},
    {"saved", 1, {"saved", "已保存"}},
    {"calibration", 0x00, {"calibration failed", "校准失败"}},
    {"calibration", 0x01, {"calibrated", "校准完成"}},
    {"calibration", 0x10, {"calibration failed, phases reversed", "校准失败，相序相反"}},
    {"calibration", 0x11, {"calibrated, phases reversed", "校准完成，相序相反"}},
};

std::string errors_text(unsigned errors, Language language) {
  const BilingualText none{"no errors", "无错误"};
  return errors == 0 ? std::string(none.in(language)) : listed(error_words(errors), language);
}

std::string with_unit(double value, std::string_view unit) {
  const bool close = unit.empty() || unit == "°";
  return three_decimals(value) + (close ? "" : " ") + std::string(unit);
}

/// Formats a slot of a command for several drives: "drive 2: 1.5 A".
std::string slot_text(const ReplyValue& slot, std::uint32_t asked, Language language) {
  const std::string drive = fmt::format(
      fmt::runtime(language == Language::kChinese ? "{} 号 " : "drive {}: "), slot.name);
  if (asked == protocol::MultiCommand::kIdentifier) {
    const auto command = static_cast<std::uint32_t>(slot.value);
    return drive + (command == protocol::kNoCommand
                        ? "–"
                        : fmt::format("{} {}", command_text(command),
                                      in_language(command_name(command, protocol::Framing::kCan),
                                                  language)));
  }
  const std::string_view unit = asked == protocol::MultiTorque::kIdentifier  ? "A"
                                : asked == protocol::MultiSpeed::kIdentifier ? "°/s"
                                                                             : "°";
  return drive + with_unit(slot.value, unit);
}

std::string quantity_text(const ReplyValue& one, std::uint32_t asked, Language language) {
  if (one.name.size() == 1) return slot_text(one, asked, language);
  if (one.name == "errors") return errors_text(static_cast<unsigned>(one.value), language);
  for (const Choice& choice : kChoices) {
    if (one.name == choice.key && one.value >= choice.value &&
        one.value <= choice.value + choice.more) {
      return std::string(choice.words.in(language));
    }
  }
  const auto* const known = protocol::find_quantity(one.name);
  if (known == nullptr || known->en.empty())
    return fmt::format("{} {}", one.name, three_decimals(one.value));
  return fmt::format("{} {}", BilingualText{known->en, known->zh}.in(language),
                     with_unit(one.value, protocol::texts_of(known->unit).symbol));
}

}  // namespace

std::string_view in_language(std::string_view english, Language language) {
  if (language == Language::kEnglish) return english;
  for (const auto rows :
       {protocol::commands(), protocol::serial_commands(), protocol::multi_drive_commands()}) {
    const auto command = std::ranges::find(rows, english, &protocol::CommandInfo::name);
    if (command != rows.end()) return command->name_zh;
  }
  const auto* const found = std::ranges::find(kWords, english, &BilingualText::en);
  return found != std::end(kWords) ? found->zh : english;
}

std::string quantities_text(const std::vector<ReplyValue>& quantities, std::uint32_t asked,
                            Language language) {
  std::vector<std::string> texts;
  for (const ReplyValue& one : quantities) texts.push_back(quantity_text(one, asked, language));
  return fmt::format("{}", fmt::join(texts, language == Language::kChinese ? "，" : ", "));
}

std::vector<std::string_view> error_frame_words(std::uint32_t classes) {
  std::vector<std::string_view> words;
  for (std::size_t bit = 0; bit < kErrorClasses; ++bit) {
    if ((classes >> bit & 1U) != 0) words.push_back(kWords[bit].en);
  }
  return words;
}

std::string listed(const std::vector<std::string_view>& words, Language language) {
  std::vector<std::string_view> texts;
  for (const std::string_view word : words) texts.push_back(in_language(word, language));
  return fmt::format("{}", fmt::join(texts, language == Language::kChinese ? "、" : ", "));
}

std::string three_decimals(double value) {
  std::string text = fmt::format("{:.3f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;  // continuation byte
    // Lead byte of U+3000 and above: in these texts, all such characters are two columns wide.
    width += byte >= 0xE3U ? 2 : 1;
  }
  return width;
}

std::string padded(std::string_view text, std::size_t width) {
  return std::string(text).append(width - std::min(width, display_width(text)), ' ');
}

std::string right(std::string_view text, std::size_t width) {
  return std::string(width - std::min(width, display_width(text)), ' ').append(text);
}

}  // namespace lk::emulator

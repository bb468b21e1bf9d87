#include "emulator/record/mcap_recording.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "emulator/config/candump_log.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/ground/start_error.hpp"
#include "protocol/quantities.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kFrameSchema =
    R"({"type":"object","properties":{"from":{"type":"string","enum":["host","drive"]},)"
    R"("id":{"type":"integer"},"data":{"type":"array","items":{"type":"integer"}},)"
    R"("line":{"type":"string","description":"as in frames.log"}}})";
constexpr const char* kDirectiveSchema =
    R"({"type":"object","properties":{"time_ns":{"type":"integer"},)"
    R"("after_frames":{"type":"integer"},"bus":{"type":"string"},)"
    R"("directive":{"type":"object","properties":{}}}})";

/// Whatever replies say, each a number.
std::string reply_schema() {
  Json properties = Json::object();
  for (const protocol::Quantity& quantity : protocol::kQuantities) {
    properties[std::string(quantity.key)] = {{"type", "number"}};
  }
  return Json{{"type", "object"}, {"properties", properties}}.dump();
}

const char* media_type_of(std::string_view name) {
  return name.ends_with(".json") ? "application/json" : "application/toml";
}

Descriptor make_file(const std::filesystem::path& file) {
  Descriptor made(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
  if (made) return made;
  if (errno == EEXIST) {
    throw StartError(file.string() + " is there already; a recording needs a file of its own");
  }
  throw StartError("cannot record in " + file.string() + ": " +
                   std::generic_category().message(errno));
}

/// Calls `take` with each line, without its end.
template <typename Take>
void for_lines(const std::string& text, const Take& take) {
  for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos;
       begin = end + 1) {
    take(text.substr(begin, end - begin));
  }
}

/// As on the wire.
std::vector<std::uint8_t> bytes_of(const protocol::Frame& frame) {
  if (protocol::is_serial(frame)) {
    const protocol::WireBytes bytes = protocol::wire_bytes(frame);
    return {bytes.view().begin(), bytes.view().end()};
  }
  if (frame.kind == protocol::FrameKind::kRemote || frame.kind == protocol::FrameKind::kFd) {
    return {};
  }
  return {frame.data.begin(), frame.data.begin() + frame.dlc};
}

}  // namespace

bool is_mcap(const std::filesystem::path& place) { return place.extension() == ".mcap"; }

McapRecording::McapRecording(const std::filesystem::path& file,
                             const std::vector<RecordedText>& texts,
                             const std::vector<BusConfig>& buses)
    : file_(std::in_place, make_file(file), "lk-emu " LKEMU_VERSION) {
  begin(texts, buses);
  if (const int error = file_->flush(); error != 0) {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    throw StartError("cannot write " + file.string() + ": " +
                     std::generic_category().message(error));
  }
}

void McapRecording::begin(const std::vector<RecordedText>& texts,
                          const std::vector<BusConfig>& buses) {
  for (const auto& [name, text] : texts) file_->attach(name, media_type_of(name), text);
  const std::uint16_t frame = file_->add_schema("lk_emu.Frame", kFrameSchema);
  const std::uint16_t directive = file_->add_schema("lk_emu.Directive", kDirectiveSchema);
  const std::uint16_t reply = file_->add_schema("lk_emu.Reply", reply_schema());
  directives_ = file_->add_channel(directive, "/directives");
  for (const BusConfig& bus : buses) {
    const std::string topic = "/" + bus.interface + "/";
    Wire wire{file_->add_channel(frame, topic + "frames"), {}};
    for (const ServoConfig& servo : bus.servos) {
      wire.drives.push_back(
          {ReplyReader(servo), file_->add_channel(reply, topic + std::to_string(servo.id))});
    }
    wires_.emplace(bus.interface, std::move(wire));
  }
}

int McapRecording::write(const Batch& batch) {
  bool good = true;
  for_lines(batch[kInputs], [&](const std::string& line) { good = good && write_input(line); });
  for_lines(batch[kFrames], [&](const std::string& line) { good = good && write_frame(line); });
  const int error = file_->flush();
  return good ? error : EBADMSG;  // a bus whose name is not as candump has names
}

int McapRecording::finish(const std::string& last_inputs) {
  for_lines(last_inputs, [this](const std::string& line) { write_input(line); });
  return file_->finish();
}

bool McapRecording::write_input(const std::string& line) {
  try {
    file_->message(directives_, parse_input(line, kInputsFile, 0).at, line);
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

bool McapRecording::write_frame(const std::string& line) {
  const auto read = parse_candump_line(line);
  const auto* const parsed = std::get_if<CandumpLine>(&read);
  const auto found = parsed == nullptr ? wires_.end() : wires_.find(parsed->interface);
  if (found == wires_.end()) return false;
  const Wire& wire = found->second;
  const bool from_host = parsed->direction == CandumpLine::Direction::kSent;
  const Json json = {{"from", from_host ? "host" : "drive"},
                     {"id", parsed->frame.id},
                     {"data", bytes_of(parsed->frame)},
                     {"line", line}};
  file_->message(wire.channel, parsed->at, json.dump());
  if (from_host) return true;
  for (const Drive& drive : wire.drives) {
    Json values = Json::object();
    for (const ReplyValue& one : drive.reader.values(parsed->frame)) {
      if (protocol::find_quantity(one.name) != nullptr) values[std::string(one.name)] = one.value;
    }
    if (!values.empty()) file_->message(drive.channel, parsed->at, values.dump());
  }
  return true;
}

}  // namespace lk::emulator

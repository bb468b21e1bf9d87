// Stream of a bus's decoded frames.

#include <optional>
#include <utility>

#include "emulator/core/frame_text.hpp"
#include "emulator/io/control/control_json.hpp"
#include "emulator/io/control/stream_client.hpp"
#include "emulator/monitor/frames/decode_words.hpp"

namespace lk::emulator {
namespace {

constexpr auto kGather = std::chrono::milliseconds(20);

class FrameStream : public StreamClient {
 public:
  FrameStream(StreamPeer peer, Line& line)
      : StreamClient(std::move(peer), &HttpShared::frame_streams, 1),
        line_(line),
        reader_(line.config()) {}

 private:
  void begin() override {
    // The callback holds a weak pointer: the line must not keep a closed stream alive.
    const auto make_callback = [this, weak = weak_from_this()](Direction direction) {
      return [this, weak, direction](const TimedFrame& frame) {
        if (const auto self = weak.lock()) gather(frame, direction);
      };
    };
    Listener listener;
    listener.query = make_callback(Direction::kQuery);
    listener.reply = make_callback(Direction::kReply);
    listener_ = line_.listeners.insert(line_.listeners.end(), std::move(listener));
    const Json introduction = {{"bus", line_.name()}};
    send(introduction.dump());
  }

  enum class Direction : std::uint8_t { kQuery, kReply };

  void gather(const TimedFrame& frame, Direction direction) {
    if (gathered_.size() >= kMaxGathered) {
      ++lost_;
      return;
    }
    const bool query = direction == Direction::kQuery;
    gathered_.push_back({frame, direction, query ? line_.adviser().query_count() : 0});
    if (gathered_.size() == 1 && !writing_) schedule_send();
  }

  void schedule_send() {
    do_after(kGather, [this] { send_gathered(); });
  }

  void send_gathered() {
    Json frames = Json::array();
    for (const Gathered& one : gathered_) frames.push_back(row(one));
    gathered_.clear();
    Json message = {{"frames", std::move(frames)}};
    if (lost_ > 0) message["lost"] = lost_;
    send(message.dump(-1, ' ', false, Json::error_handler_t::replace));
  }

  struct Gathered {
    TimedFrame frame;
    Direction direction;
    std::uint64_t number;  // of the host's frame, as counted by the adviser
  };

  Json row(const Gathered& gathered) {
    const TimedFrame& timed = gathered.frame;
    const bool query = gathered.direction == Direction::kQuery;
    if (std::exchange(address_changes_, line_.bus().state().nodes.address_changes()) !=
        line_.bus().state().nodes.address_changes())
      reader_.update_addresses(line_.bus());
    const FrameWords words = query ? reader_.query(timed.frame) : reader_.reply(timed.frame);
    Json json = {{"time_s", in_seconds(timed.at)},
                 {"from", query ? "host" : "drive"},
                 {"id", words.id},
                 {"frame", frame_text(timed.frame)},
                 {"command", words.command},
                 {"name", words.name},
                 {"values", words.values}};
    if (!words.quantities.empty()) {
      // A command to several drives has slots, which depend on its CAN identifier.
      const std::uint32_t asked = timed.frame.id;
      json["says"] = quantities_text(words.quantities, asked, Language::kEnglish);
      json["says_zh"] = quantities_text(words.quantities, asked, Language::kChinese);
    }
    if (!words.mark.empty()) json["mark"] = words.mark;
    if (!words.problem.empty()) json["drawback"] = words.problem;
    // Advice on this frame may also come later; it is then missing here.
    const std::string_view advice = line_.adviser().mark_of(gathered.number);
    if (!advice.empty()) json["advice"] = advice;
    return json;
  }

  void send(std::string text) {
    writing_ = true;
    text_ = std::move(text);
    write(text_);
  }

  void on_written() override {
    writing_ = false;
    if (!gathered_.empty()) schedule_send();
  }

  void end() override {
    if (listener_) line_.listeners.erase(*listener_);
    listener_.reset();
  }

  Line& line_;
  FrameReader reader_;
  std::uint64_t address_changes_ = 0;  // address changes of the bus that the reader has applied
  std::optional<Line::ListenerKey> listener_;
  std::vector<Gathered> gathered_;
  std::string text_;  // message being sent
  bool writing_ = false;
  std::uint64_t lost_ = 0;  // frames dropped since the stream began
};

}  // namespace

void stream_frames(StreamPeer peer, Line& line) {
  std::make_shared<FrameStream>(std::move(peer), line)->start();
}

}  // namespace lk::emulator

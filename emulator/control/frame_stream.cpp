#include "emulator/control/frame_stream.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <utility>

#include "emulator/control/control_json.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/frames/decode_words.hpp"
#include "emulator/frames/frame_words.hpp"

namespace lk::emulator {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

constexpr auto kGather = std::chrono::milliseconds(20);

class FrameStream : public std::enable_shared_from_this<FrameStream> {
 public:
  FrameStream(HttpStream stream, Line& line, std::shared_ptr<HttpShared> shared,
              std::shared_ptr<Entrance> entrance)
      : socket_(std::move(stream)),
        timer_(socket_.get_executor()),
        line_(line),
        reader_(line.config()),
        shared_(std::move(shared)),
        entrance_(std::move(entrance)) {
    ++shared_->frame_streams;
    ++entrance_->connections;
    ++entrance_->streams;
  }
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;
  ~FrameStream() {
    --shared_->frame_streams;
    --entrance_->connections;
    --entrance_->streams;
  }

  void start(beast::http::request<beast::http::string_body> upgrade) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kLongestMessage);
    choose_protocol(socket_, upgrade);
    upgrade_ = std::move(upgrade);
    socket_.async_accept(upgrade_, [self = shared_from_this()](const error_code& error) {
      if (!error) self->begin();
    });
  }

 private:
  void begin() {
    // Not this stream's owner: it may end in between.
    Listener listener;
    listener.query = [weak = weak_from_this()](const TimedFrame& frame) {
      if (const auto self = weak.lock()) self->gather(frame, Direction::kQuery);
    };
    listener.reply = [weak = weak_from_this()](const TimedFrame& frame) {
      if (const auto self = weak.lock()) self->gather(frame, Direction::kReply);
    };
    listener_ = line_.add_listener(std::move(listener));
    const Json introduction = {{"bus", line_.name()}};
    text_ = introduction.dump();
    write();
    read();
  }

  enum class Direction : std::uint8_t { kQuery, kReply };

  void gather(const TimedFrame& frame, Direction direction) {
    if (gathered_.size() >= kMostGathered) {
      ++lost_;
      return;
    }
    const bool query = direction == Direction::kQuery;
    gathered_.push_back({frame, direction, query ? line_.adviser().heard() : 0});
    if (gathered_.size() == 1 && !writing_) tell_soon();
  }

  void tell_soon() {
    timer_.expires_after(kGather);
    timer_.async_wait([weak = weak_from_this()](const error_code& error) {
      const auto self = weak.lock();
      if (!error && self && self->listener_) self->tell();
    });
  }

  void tell() {
    Json frames = Json::array();
    for (const Gathered& one : gathered_) frames.push_back(row(one));
    gathered_.clear();
    Json message = {{"frames", std::move(frames)}};
    if (lost_ > 0) message["lost"] = lost_;
    text_ = message.dump(-1, ' ', false, Json::error_handler_t::replace);
    write();
  }

  struct Gathered {
    TimedFrame frame;
    Direction direction;
    std::uint64_t number;  // of a host's frame, as the adviser counts
  };

  Json row(const Gathered& gathered) {
    const TimedFrame& timed = gathered.frame;
    const bool query = gathered.direction == Direction::kQuery;
    if (std::exchange(moves_, line_.bus().moves()) != line_.bus().moves())
      reader_.follow(line_.bus());
    const FrameWords words = query ? reader_.query(timed.frame) : reader_.reply(timed.frame);
    Json json = {{"time_s", seconds(timed.at)},
                 {"from", query ? "host" : "drive"},
                 {"id", words.id},
                 {"frame", frame_text(timed.frame)},
                 {"command", words.command},
                 {"name", words.name},
                 {"values", words.values}};
    if (!words.quantities.empty()) {
      // Only queries of several drives have slots; they are told apart by their identifiers.
      const std::uint32_t asked = timed.frame.id;
      json["says"] = quantities_text(words.quantities, asked, Language::kEnglish);
      json["says_zh"] = quantities_text(words.quantities, asked, Language::kChinese);
    }
    if (!words.mark.empty()) json["mark"] = words.mark;
    if (!words.drawback.empty()) json["drawback"] = words.drawback;
    // What is found out of a frame by the time it is told.
    const std::string_view advice = line_.adviser().mark_of(gathered.number);
    if (!advice.empty()) json["advice"] = advice;
    return json;
  }

  void write() {
    writing_ = true;
    socket_.text(true);
    socket_.async_write(boost::asio::buffer(text_),
                        [self = shared_from_this()](const error_code& error, std::size_t /*n*/) {
                          self->writing_ = false;
                          if (error) {
                            self->end();
                          } else if (!self->gathered_.empty()) {
                            self->tell_soon();
                          }
                        });
  }

  /// Whatever the client says is not of interest; that it goes is.
  void read() {
    incoming_.clear();
    socket_.async_read(incoming_,
                       [self = shared_from_this()](const error_code& error, std::size_t /*n*/) {
                         if (error) {
                           self->end();
                         } else {
                           self->read();
                         }
                       });
  }

  void end() {
    if (listener_) line_.remove_listener(*listener_);
    listener_.reset();
    timer_.cancel();
  }

  websocket::stream<HttpStream, false> socket_;
  boost::asio::steady_timer timer_;
  Line& line_;
  FrameReader reader_;
  std::uint64_t moves_ = 0;  // of the bus, that the reader has followed
  std::shared_ptr<HttpShared> shared_;
  std::shared_ptr<Entrance> entrance_;
  beast::http::request<beast::http::string_body> upgrade_;
  beast::flat_buffer incoming_;
  std::optional<Line::ListenerKey> listener_;
  std::vector<Gathered> gathered_;
  std::string text_;  // on its way
  bool writing_ = false;
  std::uint64_t lost_ = 0;  // frames, since the stream began
};

}  // namespace

void stream_frames(HttpStream stream, beast::http::request<beast::http::string_body> upgrade,
                   Line& line, std::shared_ptr<HttpShared> shared,
                   std::shared_ptr<Entrance> entrance) {
  std::make_shared<FrameStream>(std::move(stream), line, std::move(shared), std::move(entrance))
      ->start(std::move(upgrade));
}

}  // namespace lk::emulator

#include "emulator/control/body_stream.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <utility>

#include "emulator/control/body_json.hpp"

namespace lk::emulator {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

constexpr auto kPeriod = std::chrono::microseconds(16'667);

class BodyStream : public std::enable_shared_from_this<BodyStream> {
 public:
  BodyStream(HttpStream stream, std::shared_ptr<HttpShared> shared,
             std::shared_ptr<Entrance> entrance)
      : socket_(std::move(stream)),
        timer_(socket_.get_executor()),
        shared_(std::move(shared)),
        entrance_(std::move(entrance)) {
    ++shared_->body_streams;
    ++entrance_->connections;
    ++entrance_->streams;
  }
  BodyStream(const BodyStream&) = delete;
  BodyStream& operator=(const BodyStream&) = delete;
  ~BodyStream() {
    --shared_->body_streams;
    --entrance_->connections;
    --entrance_->streams;
  }

  void start(beast::http::request<beast::http::string_body> upgrade) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kLongestMessage);
    choose_protocol(socket_, upgrade);
    upgrade_ = std::move(upgrade);
    socket_.async_accept(upgrade_, [self = shared_from_this()](const error_code& error) {
      if (error) return;
      self->read();
      self->timer_.expires_after(std::chrono::seconds(0));
      self->wait();
    });
  }

 private:
  /// By the period, not by when the last one was done.
  void wait() {
    timer_.async_wait([weak = weak_from_this()](const error_code& error) {
      const auto self = weak.lock();
      if (error || !self || self->ended_) return;
      self->tell();
      self->timer_.expires_at(
          std::max(self->timer_.expiry() + kPeriod, boost::asio::steady_timer::clock_type::now()));
      self->wait();
    });
  }

  /// Nothing new is nothing to tell.
  void tell() {
    const World& world = shared_->api.world();
    if (writing_ || told_at_ == world.time()) return;
    told_at_ = world.time();
    text_ = body_now_text(world);
    writing_ = true;
    socket_.text(true);
    socket_.async_write(boost::asio::buffer(text_),
                        [self = shared_from_this()](const error_code& error, std::size_t /*n*/) {
                          self->writing_ = false;
                          if (error) self->end();
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
    ended_ = true;
    timer_.cancel();
  }

  websocket::stream<HttpStream, false> socket_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<HttpShared> shared_;
  std::shared_ptr<Entrance> entrance_;
  beast::http::request<beast::http::string_body> upgrade_;
  beast::flat_buffer incoming_;
  std::string text_;  // on its way
  std::optional<SimTime> told_at_;
  bool writing_ = false;
  bool ended_ = false;
};

}  // namespace

void stream_body(HttpStream stream, beast::http::request<beast::http::string_body> upgrade,
                 std::shared_ptr<HttpShared> shared, std::shared_ptr<Entrance> entrance) {
  std::make_shared<BodyStream>(std::move(stream), std::move(shared), std::move(entrance))
      ->start(std::move(upgrade));
}

}  // namespace lk::emulator

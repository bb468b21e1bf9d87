// WebSocket streams of the control interface.

#include "emulator/io/control/stream_client.hpp"

#include <boost/asio/buffer.hpp>
#include <utility>

#include "emulator/io/control/control_api.hpp"

namespace lk::emulator {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

/// Chooses kWebSocketProtocol if the client offers it. A page sends its token as an offered
/// subprotocol (http_access.hpp), and its browser requires that the server chooses one.
void choose_protocol(websocket::stream<HttpStream, false>& socket, const HttpUpgrade& upgrade) {
  const auto offered = upgrade[beast::http::field::sec_websocket_protocol];
  if (!offers_protocol({offered.data(), offered.size()})) return;
  socket.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(beast::http::field::sec_websocket_protocol, std::string(kWebSocketProtocol));
  }));
}

}  // namespace

StreamClient::StreamClient(StreamPeer peer, double HttpShared::*used, double share)
    : socket_(std::move(peer.stream)),
      timer_(socket_.get_executor()),
      shared_(std::move(peer.shared)),
      endpoint_(std::move(peer.endpoint)),
      upgrade_(std::move(peer.upgrade)),
      used_(used),
      share_(share) {
  socket_.next_layer().expires_never();
  (*shared_).*used_ += share_;
  ++endpoint_->connections;
  ++endpoint_->streams;
}

StreamClient::~StreamClient() {
  (*shared_).*used_ -= share_;
  --endpoint_->connections;
  --endpoint_->streams;
}

void StreamClient::start() {
  socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
  socket_.read_message_max(kLongestMessage);
  choose_protocol(socket_, upgrade_);
  socket_.async_accept(upgrade_, [self = shared_from_this()](const error_code& error) {
    if (error) return;
    self->begin();
    self->read();
  });
}

void StreamClient::write(const std::string& text) {
  socket_.text(true);
  socket_.async_write(boost::asio::buffer(text),
                      [self = shared_from_this()](const error_code& error, std::size_t /*n*/) {
                        if (error) {
                          self->on_disconnect();
                        } else {
                          self->on_written();
                        }
                      });
}

/// The timer does not own the stream, which may end earlier.
void StreamClient::do_after(std::chrono::nanoseconds delay, std::function<void()> what) {
  timer_.expires_after(delay);
  timer_.async_wait([weak = weak_from_this(), what = std::move(what)](const error_code& error) {
    const auto self = weak.lock();
    if (!error && self && !self->is_closed_) what();
  });
}

/// Ignores messages of the client; only detects its disconnect.
void StreamClient::read() {
  incoming_.clear();
  socket_.async_read(incoming_,
                     [self = shared_from_this()](const error_code& error, std::size_t /*n*/) {
                       if (error) {
                         self->on_disconnect();
                       } else {
                         self->read();
                       }
                     });
}

void StreamClient::on_disconnect() {
  is_closed_ = true;
  timer_.cancel();
  end();
}

/// Called only for requests without an upgrade to WebSocket, as `get_frames`.
void get_telemetry(const ApiCall& call) {
  read_telemetry_request(call.world, call.request);
  call.reply(error_response(426, "Upgrade", "telemetry comes over a WebSocket"));
}

void get_frames(const ApiCall& call) {
  read_frames_request(call.world, call.request);
  call.reply(error_response(426, "Upgrade", "frames come over a WebSocket"));
}

/// Answers a request without an upgrade with the body's shape, to which the stream's poses belong.
void get_body(const ApiCall& call) {
  check_body_request(call.world, call.request);
  call.world.serve_all();
  call.reply({200, body_json(call.world), ""});
}

void check_body_request(const World& world, const ApiRequest& request) {
  if (!request.query.empty()) {
    throw ApiError(400, request.query.begin()->first, "unknown; this request has no parameters");
  }
  if (drawable_body(world) == nullptr) throw ApiError(404, "body", "the robot has no [body]");
}

Line& read_frames_request(World& world, const ApiRequest& request) {
  const std::string* bus = nullptr;
  for (const auto& [key, value] : request.query) {
    if (key != "bus") throw ApiError(400, key, "unknown; known: bus");
    bus = &value;
  }
  return line_of(world, bus);
}

}  // namespace lk::emulator

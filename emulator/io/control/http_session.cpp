#include "emulator/io/control/http_session.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <cerrno>
#include <optional>

#include "emulator/config/config_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/io/control/http_access.hpp"
#include "emulator/io/control/streams.hpp"
#include "emulator/io/control/web_files.hpp"

namespace lk::emulator {
namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;

constexpr std::size_t kReadAtOnce = 4096;
constexpr std::size_t kLongestBuffer = 16'384;  // with requests sent before the last answer
constexpr auto kLingerTimeout = std::chrono::seconds(1);
constexpr int kMaxLingerReads = 256;
/// The dashboard loads only its own files, and no other page can frame it.
constexpr const char* kPagePolicy =
    "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'";

/// The page reads its language from this attribute (web/words.js).
constexpr std::string_view kPageLanguage = "data-lang=\"\"";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }
beast::string_view view(std::string_view text) { return {text.data(), text.size()}; }

int status_of(const error_code& error) {
  if (error == http::error::header_limit) return 431;
  if (error == http::error::body_limit) return 413;
  return 400;
}

/// Returns true if the request itself is at fault, not the state that it reads or changes.
bool is_refusal(int status, std::string_view where) {
  return status != 409 && status < 500 && (status != 404 || where == "path");
}

/// Returns the kind of a refusal for the log. Omits a `where` that the client has chosen: otherwise
/// there could be any number of kinds.
std::string kind_of(int status, std::string_view where) {
  constexpr std::string_view kOwnWords[] = {"Authorization", "Content-Type", "Host", "Origin",
                                            "WebSocket",     "body",         "path"};
  const bool own = std::ranges::find(kOwnWords, where) != std::end(kOwnWords);
  return std::to_string(status) + (own ? " " + std::string(where) : "");
}

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(HttpSocket socket, std::shared_ptr<HttpShared> shared,
              std::shared_ptr<HttpEndpoint> endpoint)
      : stream_(std::move(socket)), shared_(std::move(shared)), endpoint_(std::move(endpoint)) {
    ++endpoint_->connections;
  }
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;
  ~HttpSession() {
    no_longer_idle();
    --endpoint_->connections;
  }

  /// Waits for the next request or the end of the connection. Requests that come before the last
  /// answer is sent wait in `buffer_` and in the socket.
  void wait() {
    if (buffer_.size() > 0) {
      read_header();
      return;
    }
    stream_.expires_after(endpoint_->timeouts.idle);
    idle_ = endpoint_->idle.insert(endpoint_->idle.end(), [this] {
      no_longer_idle();
      stream_.close();
    });
    stream_.async_read_some(buffer_.prepare(kReadAtOnce),
                            [self = shared_from_this()](const error_code& error, std::size_t size) {
                              self->no_longer_idle();
                              if (error) return;
                              self->buffer_.commit(size);
                              self->read_header();
                            });
  }

 private:
  void read_header() {
    parser_.emplace();
    parser_->header_limit(kLongestHeader);
    parser_->body_limit(kLongestBody);
    stream_.expires_after(endpoint_->timeouts.request);  // for the whole request
    http::async_read_header(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
          if (error) {
            self->refuse_unreadable(error);
          } else {
            self->check_header();
          }
        });
  }

  void check_header() {
    const auto& header = parser_->get();
    for (const auto field : {http::field::host, http::field::origin, http::field::authorization}) {
      if (header.count(field) < 2) continue;
      refuse(400, std::string(view(http::to_string(field))), "is given twice");
      return;
    }
    const auto origin = header.find(http::field::origin);
    const std::string offered = authorization_of(view(header[http::field::sec_websocket_protocol]));
    std::string_view target = view(header.target());
    const auto authority = take_authority(target);
    const Credentials shown{
        authority ? *authority : view(header[http::field::host]),
        origin != header.end() ? std::optional(view(origin->value())) : std::nullopt,
        offered.empty() ? view(header[http::field::authorization]) : offered};
    const EmbeddedFile* const file = find_web_file(target);
    // Files of the dashboard are public: a browser has no token before it has loaded them.
    const auto refused = file != nullptr
                             ? refusal({.own_pages_only = endpoint_->access.own_pages_only}, shown)
                             : refusal(endpoint_->access, shown);
    if (refused) {
      refuse(refused->status, refused->where, refused->reason);
      return;
    }
    request_ = {};
    request_.method = head() ? "GET" : std::string(view(header.method_string()));
    request_.content_type = std::string(view(header[http::field::content_type]));
    request_.from_page = shown.origin.has_value();
    request_.pages_may_write = endpoint_->access.pages_may_write;
    request_.same_user = endpoint_->same_user;
    request_.has_token = !endpoint_->access.token.empty();  // without it, refused above
    request_.is_public = endpoint_->access.open_to_others;
    if (file != nullptr) {
      send_file(*file, view(header[http::field::if_none_match]));
      return;
    }
    try {
      read_target(target, request_);
      if (beast::websocket::is_upgrade(header)) {
        upgrade();
        return;
      }
    } catch (const ApiError& problem) {
      refuse(problem.status, problem.where, problem.what());
      return;
    }
    read_body();
  }

  void read_body() {
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
                       if (error) {
                         self->refuse_unreadable(error);
                       } else {
                         self->dispatch();
                       }
                     });
  }

  void dispatch() {
    request_.body = std::move(parser_->get().body());
    keep_alive_ = parser_->get().keep_alive();
    if (request_.method == "GET" && is_disconnected()) return;
    const unsigned mine = ++requests_;
    waiting_ = true;
    shared_->api.handle(request_, [self = shared_from_this()](const ApiResponse& response) {
      self->waiting_ = false;
      self->log_if_refused("API", response);
      self->write(response);
    });
    if (waiting_ && mine == requests_) watch_for_hang_up(mine);
  }

  /// Cancels the work on a pending answer if the client disconnects.
  void watch_for_hang_up(unsigned mine) {
    stream_.expires_never();
    if (buffer_.size() == kLongestBuffer) return;
    stream_.socket().async_wait(HttpSocket::wait_read,
                                [self = shared_from_this(), mine](const error_code& error) {
                                  if (error || !self->waiting_ || mine != self->requests_) return;
                                  if (self->has_hung_up()) {
                                    self->shared_->api.abandon();
                                  } else {
                                    self->watch_for_hang_up(mine);
                                  }
                                });
  }

  /// Reads the bytes of further requests, as far as there is room: the end of the stream is behind
  /// them.
  bool has_hung_up() {
    const auto into = buffer_.prepare(std::min(kReadAtOnce, kLongestBuffer - buffer_.size()));
    const auto size =
        ::recv(stream_.socket().native_handle(), into.data(), into.size(), MSG_DONTWAIT);
    if (size < 0) return errno != EAGAIN && errno != EINTR;
    buffer_.commit(static_cast<std::size_t>(size));
    return size == 0;
  }

  /// Detects a disconnect even if bytes of further requests are unread.
  bool is_disconnected() {
    pollfd socket{stream_.socket().native_handle(), POLLRDHUP, 0};
    return ::poll(&socket, 1, 0) > 0;
  }

  bool head() const {
    return parser_->is_header_done() && parser_->get().method() == http::verb::head;
  }

  void no_longer_idle() {
    if (idle_) endpoint_->idle.erase(*idle_);
    idle_.reset();
  }

  /// Checks headers that the library would refuse with its own messages.
  void check_handshake() const {
    const auto& header = parser_->get();
    constexpr std::size_t kKeyLength = 24;  // 16 bytes in base64
    if (header[http::field::host].empty()) throw ApiError(400, "Host", "missing");
    if (header[http::field::sec_websocket_version] != "13") {
      throw ApiError(400, "Sec-WebSocket-Version", "must be 13");
    }
    if (header[http::field::sec_websocket_key].size() != kKeyLength) {
      throw ApiError(400, "Sec-WebSocket-Key", "must be 16 bytes in base64");
    }
  }

  void upgrade() {
    if (endpoint_->streams >= kMaxStreams) {
      throw ApiError(429, "WebSocket", "there are " + std::to_string(kMaxStreams) + " already");
    }
    World& world = shared_->api.world();
    if (request_.path == ControlApi::kFramesPath) {
      check_handshake();
      Line& line = read_frames_request(world, request_);
      check_room("frames", shared_->frame_streams < kMaxFrameStreams);
      stream_frames(peer(), line);
    } else if (request_.path == ControlApi::kBodyPath) {
      check_handshake();
      check_body_request(world, request_);
      check_room("body", shared_->body_streams < kMaxBodyStreams);
      stream_body(peer());
    } else if (request_.path == ControlApi::kTelemetryPath) {
      check_handshake();
      const TelemetryRequest wanted = read_telemetry_request(world, request_);
      const double values = wanted.rate_Hz * wanted.values();
      if (shared_->telemetry_values + values > kMaxTelemetryOfAll) {
        throw ApiError(429, "rate_Hz", "all clients together ask for too many values per second");
      }
      stream_telemetry(peer(), wanted);
    } else {
      throw ApiError(404, "path", "this path has no WebSocket");
    }
  }
  StreamPeer peer() { return {std::move(stream_), parser_->release(), shared_, endpoint_}; }
  static void check_room(const char* what, bool has_room) {
    if (has_room) return;
    throw ApiError(429, what, "too many streams are open; close another one");
  }

  void refuse_unreadable(const error_code& error) {
    if (error == beast::error::timeout) {
      log_refusal(*endpoint_, "slow request", "request: took too long to arrive");
    }
    if (error.category() != http::make_error_code(http::error::end_of_stream).category() ||
        error == http::error::end_of_stream || error == http::error::partial_message) {
      return;  // the client has gone, or is too slow
    }
    refuse(status_of(error), "request", error.message());
  }

  /// Closes the connection after the answer: the rest of the stream cannot be trusted.
  void refuse(int status, const std::string& where, const std::string& reason) {
    keep_alive_ = false;
    const ApiResponse response = error_response(status, where, reason);
    log_if_refused("HTTP", response);
    write(response);
  }

  /// Pre: the request has no body, or its body can be ignored: it is not read.
  void send_file(const EmbeddedFile& file, std::string_view known_etag) {
    keep_alive_ = parser_->get().keep_alive() && parser_->is_done();
    if (request_.method != "GET") {
      ApiResponse response =
          error_response(405, "method", "method not allowed; allowed: GET, HEAD");
      response.allow = "GET, HEAD";
      log_if_refused("HTTP", response);
      write(response);
      return;
    }
    std::string etag(file.etag);
    std::string body(file.body);
    const std::string& language = endpoint_->page_language;
    const std::size_t at = file.path == "/" ? body.find(kPageLanguage) : std::string::npos;
    if (!language.empty() && at != std::string::npos) {
      body.replace(at, kPageLanguage.size(), "data-lang=\"" + language + "\"");
      etag.insert(etag.size() - 1, "-" + language);
    }
    const bool known = known_etag == etag;
    begin_response(known ? 304 : 200, file.type);
    response_.set(http::field::cache_control, "no-cache");
    response_.set(http::field::etag, etag);
    response_.set("Content-Security-Policy", kPagePolicy);
    response_.set("Referrer-Policy", "no-referrer");
    if (!known) {
      response_.content_length(body.size());
      if (!head()) response_.body() = std::move(body);
    }
    send_response();
  }

  void begin_response(int status, std::string_view type) {
    response_ = {};
    response_.version(11);
    response_.result(static_cast<unsigned>(status));
    response_.set(http::field::content_type, view(type));
    response_.set("X-Content-Type-Options", "nosniff");
  }

  void write(const ApiResponse& response) {
    begin_response(response.status, "application/json");
    response_.set(http::field::cache_control, "no-store");
    if (!response.allow.empty()) response_.set(http::field::allow, response.allow);
    if (response.status == 401) response_.set(http::field::www_authenticate, "Bearer");
    std::string body = response.body.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    response_.content_length(body.size());
    if (!head()) response_.body() = std::move(body);
    send_response();
  }

  void log_if_refused(const std::string& by, const ApiResponse& response) {
    if (response.status < 400) return;
    const Json& error = response.body.at("error");
    const auto where = error.at("where").get<std::string>();
    if (!is_refusal(response.status, where)) return;
    const auto reason = error.at("reason").get<std::string>();
    log_refusal(*endpoint_, by + " " + kind_of(response.status, where),
                std::to_string(response.status) + " " + where + ": " + reason);
  }

  void send_response() {
    response_.keep_alive(keep_alive_);
    stream_.expires_after(endpoint_->timeouts.request);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](const error_code& error, std::size_t /*size*/) {
                        if (error == beast::error::timeout) {
                          log_refusal(*self->endpoint_, "slow answer",
                                      "answer: the client did not read it in time");
                        } else if (!error && self->keep_alive_) {
                          self->wait();
                        } else if (!error) {
                          self->linger_then_close();
                        }
                      });
  }

  /// Reads the client's remaining bytes first: closing a socket with unread bytes would discard the
  /// answer.
  void linger_then_close() {
    error_code ignored;
    stream_.socket().shutdown(HttpSocket::shutdown_send, ignored);
    stream_.expires_after(kLingerTimeout);
    discard_input(0);
  }

  void discard_input(int times) {
    buffer_.clear();
    stream_.async_read_some(
        buffer_.prepare(kReadAtOnce),
        [self = shared_from_this(), times](const error_code& error, std::size_t /*size*/) {
          if (!error && times < kMaxLingerReads) self->discard_input(times + 1);
        });
  }

  HttpStream stream_;
  std::shared_ptr<HttpShared> shared_;
  std::shared_ptr<HttpEndpoint> endpoint_;
  std::optional<std::list<std::function<void()>>::iterator> idle_;  // set while idle
  beast::flat_buffer buffer_{kLongestBuffer};
  std::optional<http::request_parser<http::string_body>> parser_;
  ApiRequest request_;
  http::response<http::string_body> response_;
  bool keep_alive_ = true;
  bool waiting_ = false;  // the API has not answered yet
  unsigned requests_ = 0;
};

}  // namespace

void log_refusal(HttpEndpoint& endpoint, const std::string& kind, const std::string& reason) {
  if (!endpoint.logged_refusals.insert(kind).second) return;
  spdlog::warn("control: a client was refused: {} (logged once; further ones of this kind are not)",
               sanitized_line(reason));
}

void serve_http(HttpSocket socket, std::shared_ptr<HttpShared> shared,
                std::shared_ptr<HttpEndpoint> endpoint) {
  std::make_shared<HttpSession>(std::move(socket), std::move(shared), std::move(endpoint))->wait();
}

}  // namespace lk::emulator

#include "emulator/control/telemetry_stream.hpp"

#include <fmt/format.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <cmath>
#include <deque>
#include <iterator>
#include <optional>

#include "emulator/control/control_json.hpp"
#include "emulator/core/scenario/sampler.hpp"

namespace lk::emulator {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

constexpr auto kLongestGather = std::chrono::milliseconds(20);

void append_number(std::string& text, double value) {
  if (std::isfinite(value)) {
    fmt::format_to(std::back_inserter(text), "{}", value);
  } else {
    text += "null";
  }
}

class TelemetryStream : public std::enable_shared_from_this<TelemetryStream> {
 public:
  TelemetryStream(HttpStream stream, TelemetryRequest wanted, std::shared_ptr<HttpShared> shared,
                  std::shared_ptr<Entrance> entrance)
      : socket_(std::move(stream)),
        flush_(socket_.get_executor()),
        wanted_(std::move(wanted)),
        shared_(std::move(shared)),
        entrance_(std::move(entrance)) {
    ++entrance_->connections;
    ++entrance_->streams;
    shared_->telemetry_values += values_a_second();
  }
  TelemetryStream(const TelemetryStream&) = delete;
  TelemetryStream& operator=(const TelemetryStream&) = delete;
  ~TelemetryStream() {
    --entrance_->connections;
    --entrance_->streams;
    shared_->telemetry_values -= values_a_second();
  }

  void start(beast::http::request<beast::http::string_body> upgrade) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kLongestMessage);
    choose_protocol(socket_, upgrade);
    upgrade_ = std::move(upgrade);
    socket_.async_accept(upgrade_, [self = shared_from_this()](const error_code& error) {
      if (error) return;
      self->begin();
    });
  }

 private:
  double values_a_second() const { return wanted_.rate_Hz * wanted_.values(); }

  void begin() {
    std::vector<SampledColumn> columns;
    for (const int id : wanted_.ids) {
      for (const Signal* signal : wanted_.signals) columns.push_back({id, signal});
    }
    const int any = wanted_.line->config().servos.front().id;
    for (const Signal* signal : wanted_.body_signals) columns.push_back({any, signal});
    sampler_.emplace(std::move(columns), wanted_.line->bus().time(), wanted_.period);
    tell(introduction());
    // Not this stream's owner: it may end in between.
    watcher_ =
        wanted_.line->add_watcher({[weak = weak_from_this()] {
                                     const auto self = weak.lock();
                                     return self ? self->sampler_->next_due() : SimTime::max();
                                   },
                                   [weak = weak_from_this()](const Bus& bus) {
                                     if (const auto self = weak.lock()) self->look(bus);
                                   }});
    read();
  }

  std::string introduction() const {
    Json names = Json::array();
    for (const Signal* signal : wanted_.signals) names.push_back(signal->name);
    Json json = {{"bus", wanted_.line->name()},
                 {"ids", wanted_.ids},
                 {"signals", names},
                 {"rate_Hz", wanted_.rate_Hz}};
    for (const Signal* signal : wanted_.body_signals) json["body"].push_back(signal->name);
    return json.dump();
  }

  void look(const Bus& bus) {
    sampler_->look(bus, row_);
    if (queued_ + gathered_.size() > kMostQueued) {
      ++lost_;
      return;
    }
    std::string& text = gathered_;
    text += gathered_samples_++ == 0 ? "" : ",";
    text += "{\"time_s\":";
    append_number(text, seconds(bus.time()));
    if (lost_ > 0) fmt::format_to(std::back_inserter(text), ",\"lost\":{}", lost_);
    text += ",\"rows\":[";
    auto value = row_.begin();
    for (const int id : wanted_.ids) {
      fmt::format_to(std::back_inserter(text), "{}[{}", value == row_.begin() ? "" : ",", id);
      for (std::size_t n = 0; n < wanted_.signals.size(); ++n) {
        text += ',';
        append_number(text, *value++);
      }
      text += ']';
    }
    text += ']';
    for (auto left = value; value != row_.end(); ++value) {
      text += value == left ? ",\"body\":[" : ",";
      append_number(text, *value);
    }
    text += wanted_.body_signals.empty() ? "}" : "]}";
    if (gathered_samples_ >= wanted_.samples_per_message) {
      tell_gathered();
    } else if (gathered_samples_ == 1) {
      flush_.expires_after(kLongestGather);
      flush_.async_wait([weak = weak_from_this()](const error_code& error) {
        if (const auto self = weak.lock(); self && !error) self->tell_gathered();
      });
    }
  }

  void tell_gathered() {
    if (gathered_samples_ == 0 || !watcher_) return;
    gathered_samples_ = 0;
    if (wanted_.samples_per_message > 1) {
      tell("[" + std::exchange(gathered_, {}) + "]");
    } else {
      tell(std::exchange(gathered_, {}));
    }
  }

  void tell(std::string text) {
    queued_ += text.size();
    queue_.push_back(std::move(text));
    if (queue_.size() == 1) write();
  }

  void write() {
    socket_.text(true);
    socket_.async_write(boost::asio::buffer(queue_.front()),
                        [self = shared_from_this()](const error_code& error, std::size_t /*n*/) {
                          if (error) {
                            self->end();
                            return;
                          }
                          self->queued_ -= self->queue_.front().size();
                          self->queue_.pop_front();
                          if (!self->queue_.empty()) self->write();
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
    if (watcher_) wanted_.line->remove_watcher(*watcher_);
    watcher_.reset();
    flush_.cancel();
  }

  websocket::stream<HttpStream, false> socket_;
  boost::asio::steady_timer flush_;
  TelemetryRequest wanted_;
  std::shared_ptr<HttpShared> shared_;
  std::shared_ptr<Entrance> entrance_;
  beast::http::request<beast::http::string_body> upgrade_;
  beast::flat_buffer incoming_;
  std::optional<Sampler> sampler_;
  std::optional<Line::WatcherKey> watcher_;
  std::vector<double> row_;
  std::string gathered_;  // samples of the next message
  int gathered_samples_ = 0;
  std::deque<std::string> queue_;
  std::size_t queued_ = 0;  // bytes
  std::uint64_t lost_ = 0;  // samples, since the stream began
};

}  // namespace

void choose_protocol(websocket::stream<HttpStream, false>& socket,
                     const beast::http::request<beast::http::string_body>& upgrade) {
  const auto offered = upgrade[beast::http::field::sec_websocket_protocol];
  if (!offers_protocol({offered.data(), offered.size()})) return;
  socket.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(beast::http::field::sec_websocket_protocol, std::string(kWebSocketProtocol));
  }));
}

void stream_telemetry(HttpStream stream, beast::http::request<beast::http::string_body> upgrade,
                      const TelemetryRequest& wanted, std::shared_ptr<HttpShared> shared,
                      std::shared_ptr<Entrance> entrance) {
  std::make_shared<TelemetryStream>(std::move(stream), wanted, std::move(shared),
                                    std::move(entrance))
      ->start(std::move(upgrade));
}

}  // namespace lk::emulator

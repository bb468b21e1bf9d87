#include "emulator/io/transports/socketcand.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/host_name.hpp>

#include "emulator/core/text.hpp"

namespace lk::emulator {

using boost::asio::ip::address_v4;
using boost::asio::ip::udp;

std::string beacon_text(const std::string& host, const std::string& address, std::uint16_t port) {
  return fmt::format(
      "<CANBeacon name=\"{}\" type=\"SocketCAN\" description=\"lk-emu\">\n"
      "<URL>can://{}:{}</URL><Bus name=\"can0\"/></CANBeacon>",
      host, address, port);
}

Beacon::Beacon(boost::asio::io_context& loop, const address_v4& address, std::uint16_t port)
    : socket_(loop),
      all_(address.is_loopback() ? address_v4({127, 255, 255, 255}) : address_v4::broadcast(),
           kPort) {
  boost::system::error_code error;
  const std::string host = boost::asio::ip::host_name(error);
  text_ = beacon_text(error ? "localhost" : host, address.to_string(), port);
  // A failed send is ignored: a client that knows the address needs no beacon.
  socket_.open(udp::v4(), error);
  socket_.set_option(boost::asio::socket_base::broadcast(true), error);
  socket_.bind({address, 0}, error);
  socket_.non_blocking(true, error);
}

void Beacon::send_if_due() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + kPause;
  boost::system::error_code error;
  socket_.send_to(boost::asio::buffer(text_), all_, 0, error);
}

namespace {

using protocol::Frame;
using protocol::FrameKind;

constexpr const char* kDone = "< ok >";
constexpr const char* kNoRoom = "< error could not send frame >";
constexpr const char* kUnknown = "< error unknown command >";
// The longest message has 13: add, seconds, microseconds, identifier, length, eight bytes.
constexpr std::size_t kMaxWords = 14;

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (words.size() <= kMaxWords) {
    text = trimmed(text);
    if (text.empty()) break;
    words.push_back(text.substr(0, text.find(' ')));
    text.remove_prefix(words.back().size());
  }
  return words;
}

/// Parses an identifier; one of eight digits, or above the standard range, is extended.
std::optional<Frame> read_id(std::string_view digits) {
  const auto id = number_of(digits, 16, protocol::kMaxExtendedId);
  if (!id) return std::nullopt;
  Frame frame;
  frame.id = static_cast<std::uint32_t>(*id);
  frame.extended = digits.size() == 8 || *id > protocol::kMaxStandardId;
  frame.dlc = 0;
  return frame;
}

/// Parses identifier, length and bytes: "141 8 9A 0 0 0 0 0 0 0".
std::optional<Frame> read_frame(std::span<const std::string_view> words) {
  if (words.size() < 2) return std::nullopt;
  auto frame = read_id(words[0]);
  const auto length = number_of(words[1], 10, protocol::kCanBytes);
  if (!frame || !length || words.size() != 2 + *length) return std::nullopt;
  frame->dlc = static_cast<std::uint8_t>(*length);
  for (std::size_t n = 0; n < *length; ++n) {
    const auto byte = number_of(words[2 + n], 16, 0xFF);
    if (!byte) return std::nullopt;
    frame->data[n] = static_cast<std::uint8_t>(*byte);
  }
  return frame;
}

/// Parses seconds and microseconds: "1 500000" is 1.5 s.
std::optional<ClientProtocol::Time> read_time(std::string_view seconds, std::string_view us) {
  constexpr std::uint32_t kLongest_s = 1'000'000;
  const auto whole = number_of(seconds, 10, kLongest_s);
  const auto part = number_of(us, 10, 999'999);
  if (!whole || !part) return std::nullopt;
  return std::chrono::seconds(*whole) + std::chrono::microseconds(*part);
}

std::string id_text(const Frame& frame) {
  return frame.extended ? fmt::format("{:08X}", frame.id) : fmt::format("{:03X}", frame.id);
}

}  // namespace

void Socketcand::parse(std::span<const std::uint8_t> bytes, Time now, ParsedInput& parsed) {
  const auto refuse = [&] {
    ++parsed.malformed;
    parsed.response += kUnknown;
  };
  messages_.split(
      bytes,
      [&](std::string_view message) {
        const std::size_t begin = message.find('<');  // bytes before it are ignored
        if (begin == std::string_view::npos || !obey(message.substr(begin + 1), now, parsed))
          refuse();
      },
      refuse);
}

bool Socketcand::obey(std::string_view text, Time now, ParsedInput& parsed) {
  const Words words = words_of(text);
  if (words.empty() || words.size() > kMaxWords) return false;
  const std::string_view word = words.front();
  if (word == "echo" && words.size() == 1) {
    parsed.response += "< echo >";
    return true;
  }
  if (mode_ == Mode::kNoBus) {
    if (word != "open" || words.size() != 2) return false;
    mode_ = Mode::kBroadcastManager;
    parsed.response += kDone;
    return true;
  }
  if (words.size() == 1) return change_mode(word, parsed);
  if (word == "send" || word == "sendrtr") return send(words, parsed);
  if (mode_ == Mode::kRaw) return false;
  if (word == "add") return add_job(words, now);
  if (word == "update") return change_job(words);
  if (word == "delete" || word == "unsubscribe") return remove(words);
  if (word == "subscribe" || word == "filter") return subscribe(words, word == "filter");
  return false;
}

bool Socketcand::change_mode(std::string_view word, ParsedInput& parsed) {
  if (word != "rawmode" && word != "bcmmode") return false;
  mode_ = word == "rawmode" ? Mode::kRaw : Mode::kBroadcastManager;
  jobs_.clear();  // a change of mode ends jobs and subscriptions
  subscriptions_.clear();
  parsed.response += kDone;
  return true;
}

bool Socketcand::send(const Words& words, ParsedInput& parsed) {
  if (words.front() == "send") {
    const auto frame = read_frame(std::span(words).subspan(1));
    if (frame && !parsed.take(*frame)) parsed.response += kNoRoom;
    return frame.has_value();
  }
  auto frame = words.size() == 3 && mode_ == Mode::kRaw ? read_id(words[1]) : std::nullopt;
  const auto length = frame ? number_of(words[2], 10, protocol::kCanBytes) : std::nullopt;
  if (!length) return false;
  frame->kind = FrameKind::kRemote;
  frame->dlc = static_cast<std::uint8_t>(*length);
  if (!parsed.take(*frame)) parsed.response += kNoRoom;
  return true;
}

/// Adds a cyclic frame, due for the first time one cycle from now, as in the kernel's broadcast
/// manager.
bool Socketcand::add_job(const Words& words, Time now) {
  if (words.size() < 5) return false;
  const auto cycle = read_time(words[1], words[2]);
  const auto frame = read_frame(std::span(words).subspan(3));
  if (!cycle || *cycle < kShortestCycle || !frame) return false;
  const Key key{frame->id, frame->extended};
  if (jobs_.size() >= kMaxJobs && !jobs_.contains(key)) return false;
  jobs_[key] = {*frame, *cycle, now + *cycle};
  return true;
}

bool Socketcand::change_job(const Words& words) {
  const auto frame = read_frame(std::span(words).subspan(1));
  if (!frame) return false;
  const auto job = jobs_.find({frame->id, frame->extended});
  if (job != jobs_.end()) job->second.frame = *frame;
  return true;
}

bool Socketcand::remove(const Words& words) {
  const auto id = words.size() == 2 ? read_id(words[1]) : std::nullopt;
  if (!id) return false;
  const Key key{id->id, id->extended};
  if (words.front() == "delete") {
    jobs_.erase(key);
  } else {
    subscriptions_.erase(key);
  }
  return true;
}

bool Socketcand::subscribe(const Words& words, bool by_content) {
  if (words.size() < 4 || (!by_content && words.size() != 4)) return false;
  const auto pause = read_time(words[1], words[2]);
  const auto frame = by_content ? read_frame(std::span(words).subspan(3)) : read_id(words[3]);
  if (!pause || !frame) return false;
  const Key key{frame->id, frame->extended};
  if (subscriptions_.size() >= kMaxJobs && !subscriptions_.contains(key)) return false;
  Subscription subscription{.pause = *pause};
  if (by_content) {
    subscription.mask.emplace();
    std::copy_n(frame->data.begin(), protocol::kCanBytes, subscription.mask->begin());
  }
  subscriptions_[key] = subscription;
  return true;
}

bool Socketcand::wants(const Frame& frame, Time now) {
  const auto found = subscriptions_.find({frame.id, frame.extended});
  if (found == subscriptions_.end()) return false;
  Subscription& subscription = found->second;
  if (subscription.last && now - subscription.shown < subscription.pause) return false;
  if (subscription.mask && subscription.last && subscription.last->dlc == frame.dlc) {
    bool changed = false;
    for (std::size_t n = 0; n < protocol::kCanBytes; ++n) {
      changed =
          changed || ((frame.data[n] ^ subscription.last->data[n]) & (*subscription.mask)[n]) != 0;
    }
    if (!changed) return false;
  }
  subscription.last = frame;
  subscription.shown = now;
  return true;
}

void Socketcand::encode(const Frame& frame, Time now, std::string& out) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
  const std::string stamp = fmt::format("{}.{:06}", us / 1'000'000, us % 1'000'000);
  const bool raw = mode_ == Mode::kRaw;
  if (frame.kind == FrameKind::kError) {
    if (raw) out += fmt::format("< error {} {} >", id_text(frame), stamp);
  } else if (frame.kind == FrameKind::kRemote) {
    if (raw) out += fmt::format("< rtr {} {} {} >", id_text(frame), stamp, frame.dlc);
  } else if (frame.kind == FrameKind::kData && (raw || wants(frame, now))) {
    out += fmt::format("< frame {} {} ", id_text(frame), stamp);
    for (std::size_t n = 0; n < frame.dlc; ++n) {
      out += fmt::format("{:02X}{}", frame.data[n], raw ? "" : " ");
    }
    out += " >";
  }
}

std::optional<ClientProtocol::Time> Socketcand::next_due() const {
  const auto first =
      std::ranges::min_element(jobs_, {}, [](const auto& job) { return job.second.due; });
  return first == jobs_.end() ? std::nullopt : std::optional(first->second.due);
}

void Socketcand::take_due(Time now, std::vector<Frame>& out) {
  for (auto& [key, job] : jobs_) {
    if (job.due > now) continue;
    out.push_back(job.frame);
    job.due = std::max(job.due + job.cycle, now);  // makes up for at most one missed cycle
  }
}

}  // namespace lk::emulator

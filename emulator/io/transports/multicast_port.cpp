#include "emulator/io/transports/multicast_port.hpp"

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/multicast.hpp>
#include <boost/asio/ip/udp.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/socket_listener.hpp"

namespace lk::emulator {

namespace ip = boost::asio::ip;
using boost::asio::ip::udp;

namespace {

using Message = nlohmann::ordered_json;
using protocol::Frame;
using protocol::FrameKind;

/// Returns an attribute of `message`: false if it is missing, as in python-can; nullopt if it is
/// not a boolean.
std::optional<bool> flag(const Message& message, const char* name) {
  const auto found = message.find(name);
  if (found == message.end()) return false;
  return found->is_boolean() ? std::optional(found->get<bool>()) : std::nullopt;
}

std::optional<std::uint64_t> number_up_to(const Message& message, const char* name,
                                          std::uint64_t most) {
  const auto found = message.find(name);
  if (found == message.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto value = found->get<std::uint64_t>();
  return value <= most ? std::optional(value) : std::nullopt;
}

bool take_data(const Message& message, Frame& frame) {
  const auto length = number_up_to(message, "dlc", protocol::kCanBytes);
  if (!length) return false;
  frame.dlc = static_cast<std::uint8_t>(*length);
  if (frame.kind == FrameKind::kRemote) return true;
  const auto data = message.find("data");
  if (data == message.end() || !data->is_binary()) return false;
  const auto& bytes = data->get_binary();
  if (bytes.size() != *length) return false;
  std::ranges::copy(bytes, frame.data.begin());
  return true;
}

}  // namespace

std::optional<Frame> parse_can_msgpack(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kLongestCanMsgpack) return std::nullopt;  // also limits the nesting depth
  constexpr bool kWholly = true;
  constexpr bool kThrow = false;
  const Message message = Message::from_msgpack(bytes.begin(), bytes.end(), kWholly, kThrow);
  if (!message.is_object()) return std::nullopt;
  const auto extended = flag(message, "is_extended_id");
  const auto remote = flag(message, "is_remote_frame");
  const auto error = flag(message, "is_error_frame");
  const auto fd = flag(message, "is_fd");
  if (!extended || !remote || !error || !fd) return std::nullopt;
  const auto id = number_up_to(message, "arbitration_id",
                               *extended ? protocol::kMaxExtendedId : protocol::kMaxStandardId);
  if (!id) return std::nullopt;
  Frame frame;
  frame.id = static_cast<std::uint32_t>(*id);
  frame.extended = *extended;
  frame.kind = *error    ? FrameKind::kError
               : *fd     ? FrameKind::kFd
               : *remote ? FrameKind::kRemote
                         : FrameKind::kData;
  if (*error || *fd) {
    frame.dlc = 0;
    return frame;
  }
  return take_data(message, frame) ? std::optional(frame) : std::nullopt;
}

std::vector<std::uint8_t> can_msgpack(const Frame& frame, std::chrono::nanoseconds stamp) {
  const bool remote = frame.kind == FrameKind::kRemote;
  const std::vector<std::uint8_t> data(frame.data.begin(),
                                       frame.data.begin() + (remote ? 0 : frame.dlc));
  const Message message{
      {"timestamp", std::chrono::duration<double>(stamp).count()},
      {"arbitration_id", frame.id},
      {"is_extended_id", frame.extended},
      {"is_remote_frame", remote},
      {"is_error_frame", frame.kind == FrameKind::kError},
      {"channel", nullptr},
      {"dlc", frame.dlc},
      {"data", Message::binary(data)},
      {"is_fd", false},
      {"bitrate_switch", false},
      {"error_state_indicator", false},
  };
  return Message::to_msgpack(message);
}

namespace {

constexpr std::size_t kMaxDatagrams = 64;  // per batch

/// Attaches a filter to `socket` that strips the payload of datagrams from other machines, which
/// then count as malformed. The sender's address proves nothing, as Linux accepts IPv6 packets that
/// claim to be from this machine. Datagrams sent on this machine are marked by the kernel
/// (PACKET_LOOPBACK), or come by `lo`, which is interface 1 of every network namespace. Returns
/// false if the kernel refuses the filter.
bool strip_datagrams_of_others(int socket) {
  constexpr auto kOf = [](int field) { return static_cast<std::uint32_t>(SKF_AD_OFF + field); };
  constexpr std::uint16_t kLoad = BPF_LD | BPF_ABS;
  constexpr std::uint16_t kIfEqual = BPF_JMP | BPF_JEQ | BPF_K;
  constexpr std::uint16_t kReturn = BPF_RET | BPF_K;
  constexpr std::uint32_t kHeaderAlone = 8;
  std::array<sock_filter, 6> code{{{kLoad | BPF_B, 0, 0, kOf(SKF_AD_PKTTYPE)},
                                   {kIfEqual, 3, 0, PACKET_LOOPBACK},
                                   {kLoad | BPF_W, 0, 0, kOf(SKF_AD_IFINDEX)},
                                   {kIfEqual, 1, 0, 1},
                                   {kReturn, 0, 0, kHeaderAlone},
                                   {kReturn, 0, 0, UINT32_MAX}}};
  const sock_fprog program{static_cast<std::uint16_t>(code.size()), code.data()};
  return ::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

class MulticastPort final : public Port {
 public:
  MulticastPort(boost::asio::io_context& loop, const std::string& name, const BusName& group,
                std::function<void()> on_frames)
      : name_(name),
        socket_(loop),
        on_frames_(std::move(on_frames)),
        bytes_(kLongestCanMsgpack + 1),  // longer datagrams are truncated, and rejected
        accepts_remote_(group.ttl > 0),
        sender_(loop),
        own_addresses_(addresses_of_this_machine()) {
    boost::system::error_code error;
    const auto address = ip::make_address(group.address, error);
    if (error || !address.is_multicast()) {
      throw StartError(name_ + ": " + group.address + " is not a multicast group");
    }
    group_ = {address, group.port};
    try {
      join(address);
      sender_.open(group_.protocol());
      sender_.set_option(ip::multicast::hops(group.ttl));
      sender_.bind({group_.protocol(), 0});
      sender_.non_blocking(true);
    } catch (const boost::system::system_error& problem) {
      throw StartError(name_ + ": cannot join the group: " + problem.code().message());
    }
    sender_port_ = sender_.local_endpoint().port();
    if (accepts_remote_) {
      spdlog::warn("{}: anyone on a network of this machine can command these drives", name_);
    }
    socket_.non_blocking(true);
    descriptor_ = socket_.native_handle();
    wait_readable();
  }

  bool is_up() const override { return true; }
  bool can_wait() const override { return false; }
  int descriptor() const override { return descriptor_; }
  std::size_t pending() const override { return 0; }
  PortStats stats() const override { return stats_; }

  /// Reads the addresses of this machine again, as they may have changed.
  void check_link() override { own_addresses_ = addresses_of_this_machine(); }

  void send(std::span<const protocol::Frame> frames) override {
    for (const protocol::Frame& frame : frames) {
      boost::system::error_code error;
      sender_.send_to(boost::asio::buffer(can_msgpack(frame, wall_now())), group_, 0, error);
      ++(error ? stats_.lost_queue_full : stats_.sent);
    }
  }

 private:
  Batch next_batch(Wait /*wait*/) override {
    received_.clear();
    for (std::size_t n = 0; n < kMaxDatagrams; ++n) {
      udp::endpoint from;
      boost::system::error_code error;
      const std::size_t size = socket_.receive_from(boost::asio::buffer(bytes_), from, 0, error);
      if (error) return {received_, false, 0};
      take({bytes_.data(), size}, from);
    }
    return {received_, true, 0};
  }

  /// Returns true unless `sender` is this port, or another machine without `accepts_remote_`.
  bool accepts(const udp::endpoint& sender) {
    const bool near = own_addresses_.contains(without_scope(sender.address()));
    if (near) return sender.port() != sender_port_;
    if (!accepts_remote_ && stats_.foreign++ == 0) {
      spdlog::warn("{}: {} is another machine: its frames are dropped (?ttl=1 lets it in)", name_,
                   sender.address().to_string());
    }
    return accepts_remote_;
  }

  void join(const ip::address& group) {
    socket_.open(group_.protocol());
    socket_.set_option(udp::socket::reuse_address(true));  // other hosts bind the same port
    if (!accepts_remote_ && !strip_datagrams_of_others(socket_.native_handle())) {
      spdlog::warn("{}: no socket filter here: other machines can forge frames of this one", name_);
    }
    socket_.bind(group_);  // not to any address: the port's other groups are other buses
    socket_.set_option(ip::multicast::join_group(group));
  }

  void wait_readable() {
    socket_.async_wait(udp::socket::wait_read, [this](const boost::system::error_code& error) {
      if (error) return;
      on_frames_();
      wait_readable();
    });
  }

  /// Appends the frame in `datagram` to `received_`, or counts it as malformed.
  void take(std::span<const std::uint8_t> datagram, const udp::endpoint& from) {
    if (!accepts(from)) return;
    if (const auto frame = parse_can_msgpack(datagram)) {
      received_.push_back({wall_now(), *frame});
    } else {
      ++stats_.malformed;
    }
  }

  std::string name_;
  udp::socket socket_;
  std::function<void()> on_frames_;
  PortStats stats_;
  int descriptor_ = -1;
  std::vector<std::uint8_t> bytes_;
  std::vector<ReceivedFrame> received_;
  bool accepts_remote_;  // accepts datagrams of other machines
  udp::endpoint group_;
  udp::socket sender_;  // its port number identifies datagrams of this process
  std::uint16_t sender_port_ = 0;
  std::set<ip::address> own_addresses_;
};

}  // namespace

std::unique_ptr<Port> make_multicast_port(boost::asio::io_context& loop, const std::string& name,
                                          const BusName& group, std::function<void()> on_frames) {
  return std::make_unique<MulticastPort>(loop, name, group, std::move(on_frames));
}

}  // namespace lk::emulator

#pragma once

/// Protocol of socketcand: CAN in ASCII messages such as "< send 141 1 9A >"
/// (docs/guides/buses.md).

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/udp.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/io/transports/client_set.hpp"

namespace lk::emulator {

/// Announces a socketcand port to clients by a broadcast datagram every three seconds. Datagrams
/// from a loopback address stay on this machine.
class Beacon {
 public:
  static constexpr std::uint16_t kPort = 42000;
  static constexpr auto kPause = std::chrono::seconds(3);

  /// Pre: `address` is an IPv4 address of this machine.
  Beacon(boost::asio::io_context& loop, const boost::asio::ip::address_v4& address,
         std::uint16_t port);
  /// Sends the beacon if it is due. Call regularly.
  void send_if_due();

 private:
  boost::asio::ip::udp::socket socket_;
  boost::asio::ip::udp::endpoint all_;
  std::string text_;
  std::chrono::steady_clock::time_point next_;
};

/// Returns the text of the beacon.
std::string beacon_text(const std::string& host, const std::string& address, std::uint16_t port);

/// The server that one client sees.
class Socketcand final : public ClientProtocol {
 public:
  /// Limit for the number of a client's cyclic frames, and for that of its subscriptions.
  static constexpr std::size_t kMaxJobs = 256;
  static constexpr Time kShortestCycle = std::chrono::milliseconds(1);

  std::string greeting() const override { return "< hi >"; }
  void parse(std::span<const std::uint8_t> bytes, Time now, ParsedInput& parsed) override;
  void encode(const protocol::Frame& frame, Time now, std::string& out) override;
  std::optional<Time> next_due() const override;
  void take_due(Time now, std::vector<protocol::Frame>& out) override;

 private:
  static constexpr std::size_t kLongestMessage = 200;  // bytes; longest `add`: below 100

  enum class Mode : std::uint8_t { kNoBus, kBroadcastManager, kRaw };
  /// Identifier of a frame: standard and extended identifiers with the same number differ.
  struct Key {
    std::uint32_t id;
    bool extended;
    auto operator<=>(const Key&) const = default;
  };
  /// A frame that the server sends cyclically.
  struct Job {
    protocol::Frame frame;
    Time cycle{0};
    Time due{0};
  };
  struct Subscription {
    Time pause{0};  // minimum time between two frames sent to the client
    std::optional<std::array<std::uint8_t, protocol::kCanBytes>> mask =
        {};  // send only if these bits have changed; nullopt: every frame
    std::optional<protocol::Frame> last = {};  // last frame sent to the client
    Time shown{0};                             // when
  };
  using Words = std::vector<std::string_view>;

  /// Executes a message, without its brackets. Returns false if it is malformed or not allowed now.
  bool obey(std::string_view text, Time now, ParsedInput& parsed);
  bool change_mode(std::string_view word, ParsedInput& parsed);
  bool send(const Words& words, ParsedInput& parsed);
  bool add_job(const Words& words, Time now);
  bool change_job(const Words& words);
  bool remove(const Words& words);
  bool subscribe(const Words& words, bool by_content);
  bool wants(const protocol::Frame& frame, Time now);

  Mode mode_ = Mode::kNoBus;
  LineBuffer messages_{'>', kLongestMessage};
  std::map<Key, Job> jobs_;
  std::map<Key, Subscription> subscriptions_;
};

}  // namespace lk::emulator

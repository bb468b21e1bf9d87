#pragma once

/// @file The protocol of socketcand, CAN in words between angle brackets (docs/buses.md).

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/transports/client_protocol.hpp"

namespace lk::emulator {

class Socketcand final : public ClientProtocol {
 public:
  /// Frames that one client has sent in cycles, and subscriptions, each.
  static constexpr std::size_t kMostJobs = 256;
  static constexpr Time kShortestCycle = std::chrono::milliseconds(1);

  std::string greeting() const override { return "< hi >"; }
  void take(std::span<const std::uint8_t> bytes, Time now, FromClient& heard) override;
  void show(const protocol::Frame& frame, Time now, std::string& out) override;
  std::optional<Time> next_due() const override;
  void take_due(Time now, std::vector<protocol::Frame>& out) override;

 private:
  static constexpr std::size_t kLongestMessage = 200;  // add, with eight bytes, is below 100

  enum class Mode : std::uint8_t { kNoBus, kBroadcastManager, kRaw };
  /// Identifiers of both lengths are different ones.
  struct Key {
    std::uint32_t id;
    bool extended;
    auto operator<=>(const Key&) const = default;
  };
  struct Job {
    protocol::Frame frame;
    Time cycle{0};
    Time due{0};
  };
  struct Subscription {
    Time pause{0};  // between two frames that are shown
    std::optional<std::array<std::uint8_t, protocol::kCanBytes>> mask =
        {};  // any change, or one of these bits
    std::optional<protocol::Frame> last = {};
    Time shown{0};
  };
  using Words = std::vector<std::string_view>;

  /// What is between the brackets. False: it is not understood.
  bool obey(std::string_view text, Time now, FromClient& heard);
  bool change_mode(std::string_view word, FromClient& heard);
  bool send(const Words& words, FromClient& heard);
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

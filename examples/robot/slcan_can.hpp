#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "host/can_port.hpp"

namespace robot {

/// A bus in real time, by slcan on a local TCP port: lk-emu's slcan-tcp, or an adapter behind
/// ser2net.
class SlcanCan : public CanPort {
 public:
  explicit SlcanCan(std::uint16_t port)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("nobody listens at port " + std::to_string(port));
    }
    ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    say("O\r");
  }
  SlcanCan(const SlcanCan&) = delete;
  SlcanCan& operator=(const SlcanCan&) = delete;
  ~SlcanCan() override { ::close(socket_); }

  void send(const CanFrame& frame) override {
    char text[40];
    int size = std::snprintf(text, sizeof text, "t%03X8", frame.id & 0x7FFU);
    for (const std::uint8_t byte : frame.data) {
      size +=
          std::snprintf(text + size, sizeof text - static_cast<std::size_t>(size), "%02X", byte);
    }
    say(std::string(text) + '\r');
  }

  std::optional<CanFrame> receive(std::chrono::microseconds timeout) override {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    for (;;) {
      if (const auto frame = take_frame()) return frame;
      const auto left = deadline - std::chrono::steady_clock::now();
      if (!read_within(std::max(left, std::chrono::steady_clock::duration::zero()))) {
        return std::nullopt;
      }
    }
  }

  void wait(std::chrono::microseconds duration) override { std::this_thread::sleep_for(duration); }

 private:
  void say(const std::string& text) const {
    if (::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) < 0) {
      throw std::runtime_error("the bus is gone");
    }
  }

  /// Returns a frame such as "t14189A1900F000000000"; skips acknowledgements and other frames.
  std::optional<CanFrame> take_frame() {
    constexpr std::size_t kWhole = 5 + 16;
    for (;;) {
      const std::size_t end = heard_.find_first_of("\r\a");
      if (end == std::string::npos) return std::nullopt;
      const std::string line = heard_.substr(0, end);
      heard_.erase(0, end + 1);
      if (line.size() < kWhole || line[0] != 't' || line[4] != '8') continue;
      CanFrame frame{.id = static_cast<std::uint32_t>(std::stoul(line.substr(1, 3), nullptr, 16))};
      for (std::size_t n = 0; n < frame.data.size(); ++n) {
        frame.data[n] =
            static_cast<std::uint8_t>(std::stoul(line.substr(5 + 2 * n, 2), nullptr, 16));
      }
      return frame;
    }
  }

  bool read_within(std::chrono::steady_clock::duration patience) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(patience);
    pollfd ready{socket_, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(left.count())) <= 0) return false;
    char text[4096];
    const ssize_t size = ::recv(socket_, text, sizeof text, 0);
    if (size <= 0) throw std::runtime_error("the bus is gone");
    heard_.append(text, static_cast<std::size_t>(size));
    return true;
  }

  int socket_;
  std::string heard_;
};

}  // namespace robot

#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "host/can_port.hpp"
#include "slcan_can.hpp"

namespace robot {

/// The clock of a running lk-emu with --clock stepped, at its control socket.
class SteppedClock {
 public:
  explicit SteppedClock(std::string path) : path_(std::move(path)) {}

  /// On return all events up to the new time have happened, and replies can be received.
  void advance(std::chrono::microseconds by) const {
    const std::string body =
        "{\"by_s\": " + std::to_string(std::chrono::duration<double>(by).count()) + "}";
    const std::string answer =
        ask("POST /api/v1/clock/advance HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
            "Content-Type: application/json\r\nContent-Length: " +
            std::to_string(body.size()) + "\r\n\r\n" + body);
    if (!answer.starts_with("HTTP/1.1 200")) throw std::runtime_error("the clock does not move");
  }

 private:
  std::string ask(const std::string& request) const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy_n(path_.begin(), std::min(path_.size(), sizeof address.sun_path - 1),
                std::begin(address.sun_path));
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    std::string answer;
    char text[4096];
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
        ::send(fd, request.data(), request.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(request.size())) {
      for (ssize_t size = 1; size > 0;) {
        size = ::recv(fd, text, sizeof text, 0);
        if (size > 0) answer.append(text, static_cast<std::size_t>(size));
      }
    }
    ::close(fd);
    return answer;
  }

  std::string path_;
};

/// A bus of a running lk-emu whose clock only advances while the robot's code waits.
class SteppedCan : public CanPort {
 public:
  SteppedCan(std::uint16_t port, std::string control) : can_(port), clock_(std::move(control)) {}

  void send(const CanFrame& frame) override { can_.send(frame); }

  std::optional<CanFrame> receive(std::chrono::microseconds timeout) override {
    constexpr std::chrono::microseconds kStep{1000};
    for (auto waited = std::chrono::microseconds(0);; waited += kStep) {
      if (auto frame = can_.receive(std::chrono::microseconds(0))) return frame;
      if (waited >= timeout) return std::nullopt;
      clock_.advance(std::min(kStep, timeout - waited));
    }
  }

  void wait(std::chrono::microseconds duration) override { clock_.advance(duration); }

 private:
  SlcanCan can_;
  SteppedClock clock_;
};

}  // namespace robot

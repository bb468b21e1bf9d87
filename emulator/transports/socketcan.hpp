#pragma once

#include <poll.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// A frame off the socket, and when the kernel received it by its wall clock (stamp_clock.hpp).
struct ReceivedFrame {
  std::chrono::nanoseconds stamp{0};
  protocol::Frame frame;
  std::uint32_t sender = 0;  // as in TimedFrame
};

/// What the kernel filter lets through.
enum class Reception : std::uint8_t {
  kEverything,   // every frame takes its time on the modelled wire, whoever it is meant for
  kDriveFrames,  // 0x140..0x17F and 0x280..0x28F, and the same numbers as extended or remote frames
};

enum class SendResult : std::uint8_t {
  kSent,
  kNotWritable,  // the socket's buffer is full: poll tells when it is not
  kQueueFull,    // the interface's queue is full: nobody tells when it is not
  kLinkDown,
};

/// A raw CAN socket bound to one interface. Blocks where that is asked for only. System calls and
/// nothing else.
class CanSocket {
 public:
  /// Throws std::system_error; the interface may be down.
  CanSocket(int interface_index, Reception reception);
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;
  ~CanSocket();

  int descriptor() const { return fd_; }

  struct Batch {
    std::span<const ReceivedFrame> frames;  // valid until the next `receive`
    bool more = false;                      // the socket may hold further frames
    int error = 0;                          // errno of the link: ENETDOWN, ENODEV, …
  };
  enum class Wait : std::uint8_t { kNot, kForOne };
  /// Whatever waits in the socket, up to a few dozen frames. `kForOne` waits when there is nothing,
  /// for about `kPatience`: as long as the kernel's tick is, 1 to 10 ms.
  Batch receive(Wait wait = Wait::kNot);
  /// As it is at first; whoever watches the descriptor may have changed it, and `kForOne` would not
  /// wait. Throws std::system_error.
  void set_blocking();
  static constexpr std::chrono::microseconds kPatience{1000};

  struct Sent {
    std::size_t count;  // of the frames, from the first
    SendResult then;    // kSent: all of them
  };
  Sent send(std::span<const protocol::Frame> frames);

  /// Frames the kernel dropped because the receive buffer was full.
  std::uint32_t kernel_drops() const { return kernel_drops_; }

 private:
  struct Buffers;
  struct Outgoing;

  std::size_t send_some(std::span<const protocol::Frame> frames);

  int fd_;
  std::uint32_t kernel_drops_ = 0;
  std::unique_ptr<Buffers> buffers_;
  std::unique_ptr<Outgoing> outgoing_;
};

/// Why there are no CAN sockets to be had here; empty: there are.
std::string can_problem();

/// Waits until one of the sockets has something to receive; a socket of −1 never has. Returns false
/// when there was nothing in time. `sockets[n].revents` tells which.
bool wait_for_frames(std::span<pollfd> sockets, std::chrono::nanoseconds patience);

}  // namespace lk::emulator

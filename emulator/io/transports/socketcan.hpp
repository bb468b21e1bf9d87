#pragma once

#include <poll.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// A received frame, and the kernel's receive time by the wall clock (stamp_clock.hpp).
struct ReceivedFrame {
  std::chrono::nanoseconds stamp{0};
  protocol::Frame frame;
  std::uint32_t sender = 0;  // as in TimedFrame
};

/// Frames that the kernel filter passes.
enum class Reception : std::uint8_t {
  kEverything,   // all frames, as each takes time on the modelled wire
  kDriveFrames,  // 0x140..0x17F and 0x280..0x28F, and the same numbers as extended or remote frames
};

enum class SendResult : std::uint8_t {
  kSent,
  kNotWritable,  // the socket's buffer is full: poll reports room
  kQueueFull,    // the interface's queue is full: no event reports room
  kLinkDown,
};

/// A raw CAN socket bound to one interface: only system calls, blocking only on request.
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
  /// Returns waiting frames, up to a few dozen. With `kForOne`, waits for a first frame: about
  /// `kReceiveTimeout`, rounded up to the kernel's tick of 1 to 10 ms.
  Batch receive(Wait wait = Wait::kNot);
  /// Restores blocking mode, which an event loop may have changed; `kForOne` needs it. Throws
  /// std::system_error.
  void set_blocking();
  static constexpr std::chrono::microseconds kReceiveTimeout{1000};

  struct Sent {
    std::size_t count;  // frames sent, from the first on
    SendResult then;    // kSent: all
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

/// Returns why CAN sockets are not available; empty if they are.
std::string can_problem();

/// Waits until a socket is readable; −1 never is. Returns false on a time-out. `sockets[n].revents`
/// tells which sockets are readable.
bool wait_for_frames(std::span<pollfd> sockets, std::chrono::nanoseconds timeout);

}  // namespace lk::emulator

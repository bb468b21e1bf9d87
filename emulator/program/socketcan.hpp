#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// A frame off the socket, and how long ago the kernel received it. Ages, not times: the kernel
/// stamps with the wall clock, and a wall clock that is set must not move the simulation.
struct ReceivedFrame {
  std::chrono::nanoseconds age{0};
  protocol::Frame frame;
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

/// A raw CAN socket bound to one interface, non-blocking. System calls and nothing else.
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
  /// Whatever waits in the socket, up to a few dozen frames.
  Batch receive();

  SendResult send(const protocol::Frame& frame);

  /// Frames the kernel dropped because the receive buffer was full.
  std::uint32_t kernel_drops() const { return kernel_drops_; }

 private:
  struct Buffers;

  void configure(Reception reception);

  int fd_;
  std::uint32_t kernel_drops_ = 0;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace lk::emulator

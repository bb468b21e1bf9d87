#pragma once

#include <cstdint>
#include <span>

#include "emulator/ground/terminal_flag.hpp"
#include "emulator/transports/socketcan.hpp"

namespace lk::emulator {

/// What a port has seen; frames by cause are the bus's to count.
struct PortStats {
  std::uint64_t kernel_drops = 0;  // frames the kernel had no room for
  std::uint64_t sent = 0;
  std::uint64_t lost_link_down = 0;   // replies that had no interface to leave by
  std::uint64_t lost_queue_full = 0;  // replies nobody took off our hands in time
  std::uint64_t pending = 0;          // replies in our hands still
  std::uint64_t waits_for_queue = 0;  // times the send queue was full
  std::uint64_t link_losses = 0;      // times the interface went down or away
  // Of a port with clients (client_set.hpp):
  std::uint64_t lost_unread = 0;  // frames for a client that did not read, by client
  std::uint64_t malformed = 0;    // lines or packets answered as errors, or dropped
  std::uint64_t foreign = 0;      // datagrams of those who are not asked for
  std::uint64_t refused = 0;      // clients refused because the port was full
};

/// By which frames come into the process and leave it: a CAN interface, a serial port, clients.
class Port {
 public:
  Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port() = default;

  using Wait = CanSocket::Wait;
  using Batch = CanSocket::Batch;

  /// Looks at the interface and follows it: at the start, whenever the kernel reports a change, and
  /// now and then, as what could not be opened may be opened later.
  virtual void check_link() = 0;
  virtual bool is_up() const = 0;
  /// `receive` can wait by itself.
  virtual bool can_wait() const = 0;

  /// Hands `take(std::span<const ReceivedFrame>)` what has arrived, up to a bound that keeps the
  /// loop responsive; returns whether that ended it. Waits for the first if that is asked for.
  /// Bytes that are not frames end it too: they must not keep time and other hosts waiting.
  template <typename Take>
  bool receive(Take&& take, Wait wait = Wait::kNot) {
    constexpr int kMostBatches = 16;
    for (int i = 0; descriptor() >= 0 && i < kMostBatches; ++i) {
      const Batch batch = next_batch(i == 0 ? wait : Wait::kNot);
      if (!batch.frames.empty()) take(batch.frames);
      if (batch.error != 0) note_error(batch.error);
      if (!batch.more) return false;
      if (batch.frames.empty()) break;
    }
    return descriptor() >= 0;
  }

  /// Frames of drives.
  virtual void send(std::span<const protocol::Frame> frames) = 0;
  /// A frame of the host `sender`, for all the others; never called where frames have no sender.
  virtual void pass_on(const protocol::Frame& /*frame*/, std::uint32_t /*sender*/) {}
  /// What has been handed over leaves now: replies, and what could be said together with them.
  virtual void end_turn() {}
  /// To wait for frames; −1: there is none.
  virtual int descriptor() const = 0;
  /// Replies in our hands still.
  virtual std::size_t pending() const = 0;
  virtual PortStats stats() const = 0;
  /// What the terminal of the host changed on its way of what was received last; none: not a
  /// terminal, or raw.
  virtual const TerminalFlags& host_flags() const { return kRaw; }

 private:
  inline static const TerminalFlags kRaw;

  virtual Batch next_batch(Wait wait) = 0;
  virtual void note_error(int error) = 0;
};

}  // namespace lk::emulator

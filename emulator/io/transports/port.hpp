#pragma once

#include <cstdint>
#include <span>

#include "emulator/core/terminal_flag.hpp"
#include "emulator/io/transports/socketcan.hpp"

namespace lk::emulator {

/// Counters of a port; the bus counts frames by cause.
struct PortStats {
  std::uint64_t kernel_drops = 0;  // frames the kernel had no room for
  std::uint64_t sent = 0;
  std::uint64_t lost_link_down = 0;   // replies sent while the interface was down
  std::uint64_t lost_queue_full = 0;  // replies lost because the send buffer was full
  std::uint64_t pending = 0;          // replies not yet sent
  std::uint64_t waits_for_queue = 0;  // times the send queue was full
  std::uint64_t link_losses = 0;      // times the interface went down or vanished
  // Only for ports with clients or datagrams:
  std::uint64_t lost_unread = 0;  // frames for clients that did not read, once per client
  std::uint64_t malformed = 0;    // lines or packets answered as errors, or dropped
  std::uint64_t foreign = 0;      // datagrams from other machines, dropped
  std::uint64_t refused = 0;      // clients refused because the port was full
};

/// Moves frames into and out of the process: a CAN interface, a serial port or network clients.
class Port {
 public:
  Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port() = default;

  using Wait = CanSocket::Wait;
  using Batch = CanSocket::Batch;

  /// Checks the interface and follows its state. Call at the start, when the kernel reports a
  /// change, and regularly: an open that failed is tried again.
  virtual void check_link() = 0;
  virtual bool is_up() const = 0;
  /// Returns whether `receive` can wait.
  virtual bool can_wait() const = 0;

  /// Passes frames to `take(std::span<const ReceivedFrame>)`; limited, to keep the loop responsive.
  /// Returns true if more may follow. `Wait::kForOne` waits for the first frame. A batch without
  /// frames ends the call: invalid bytes must not delay others.
  template <typename Take>
  bool receive(Take&& take, Wait wait = Wait::kNot) {
    constexpr int kMaxBatches = 16;
    for (int i = 0; descriptor() >= 0 && i < kMaxBatches; ++i) {
      const Batch batch = next_batch(i == 0 ? wait : Wait::kNot);
      if (!batch.frames.empty()) take(batch.frames);
      if (batch.error != 0) note_error(batch.error);
      if (!batch.more) return false;
      if (batch.frames.empty()) break;
    }
    return descriptor() >= 0;
  }

  /// Sends frames of drives.
  virtual void send(std::span<const protocol::Frame> frames) = 0;
  /// Sends a frame of the host `sender` to the other hosts; unused where frames have no sender.
  virtual void pass_on(const protocol::Frame& /*frame*/, std::uint32_t /*sender*/) {}
  /// Flushes buffered replies and frames at the end of a turn.
  virtual void end_turn() {}
  /// For waiting on frames; −1: none.
  virtual int descriptor() const = 0;
  /// Replies not yet sent.
  virtual std::size_t pending() const = 0;
  virtual PortStats stats() const = 0;
  /// Terminal settings of the host that changed the bytes received last; empty: raw, or no
  /// terminal.
  virtual const TerminalFlags& host_flags() const { return kRaw; }

 private:
  inline static const TerminalFlags kRaw;

  virtual Batch next_batch(Wait wait) = 0;
  virtual void note_error(int error) = 0;
};

}  // namespace lk::emulator

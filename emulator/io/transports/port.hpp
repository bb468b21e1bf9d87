#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/terminal_flag.hpp"
#include "emulator/io/transports/netlink.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Reading of the wall clock; the time stamp of frames from ports other than CAN sockets.
inline std::chrono::nanoseconds wall_now() {
  return std::chrono::system_clock::now().time_since_epoch();
}

/// A received frame, and the kernel's receive time by the wall clock (StampClock).
struct ReceivedFrame {
  std::chrono::nanoseconds stamp{0};
  protocol::Frame frame;
  std::uint32_t sender = 0;  // as in TimedFrame
};

/// Counters of a port. BusStats counts what the bus did with the frames.
struct PortStats {
  std::uint64_t kernel_drops = 0;  // frames the kernel had no room for
  std::uint64_t sent = 0;
  std::uint64_t lost_link_down = 0;   // replies lost because the interface was down
  std::uint64_t lost_queue_full = 0;  // replies lost because the send buffer was full
  std::uint64_t pending = 0;          // replies not yet sent
  std::uint64_t waits_for_queue = 0;  // times the send queue was full
  std::uint64_t link_losses = 0;      // times the interface went down or vanished
  // Only for ports with clients or datagrams:
  std::uint64_t lost_unread = 0;  // frames or answers lost by clients that did not read; per client
  std::uint64_t malformed = 0;    // malformed lines or packets, answered as errors or dropped
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

  struct Batch {
    std::span<const ReceivedFrame> frames;  // valid until the next batch
    bool more = false;                      // the port may hold further frames
    int error = 0;                          // errno of the link: ENETDOWN, ENODEV, …
  };
  enum class Wait : std::uint8_t { kNot, kForOne };
  /// Longest wait of `kForOne`. A CAN socket rounds it up to the kernel's tick of 1 to 10 ms.
  static constexpr std::chrono::microseconds kReceiveTimeout{1000};

  /// Checks the interface; opens or closes the port accordingly. Call at the start, when the kernel
  /// reports a change, and regularly, to retry an open that failed.
  virtual void check_link() = 0;
  virtual bool is_up() const = 0;
  /// Returns whether `receive` can wait.
  virtual bool can_wait() const = 0;

  /// Passes received frames to `take(std::span<const ReceivedFrame>)`, up to 16 batches, to keep
  /// the loop responsive. Returns true if the port may hold more. `Wait::kForOne` waits for a first
  /// frame. A batch without frames ends the call: a host that sends invalid bytes must not delay
  /// others.
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
  /// Sends a frame of the host number `sender` to the other hosts. Does nothing if the medium
  /// itself delivers the frames of a host to the others.
  virtual void pass_on(const protocol::Frame& /*frame*/, std::uint32_t /*sender*/) {}
  /// Free frames of the hosts' queue, for protocols that report a refused frame.
  virtual void set_room(std::size_t /*frames*/) {}
  /// Closes the way to the hosts, as if their adapter were unplugged, or opens it again. `moves`: a
  /// port with a path opens again under another name.
  virtual void set_gone(bool /*gone*/, bool /*moves*/) {}
  /// Flushes buffered replies and frames. Call after each processing of received frames.
  virtual void end_turn() {}
  /// Descriptor that is readable when frames have arrived; −1: the port is closed.
  virtual int descriptor() const = 0;
  /// Number of replies not yet sent.
  virtual std::size_t pending() const = 0;
  virtual PortStats stats() const = 0;
  /// Settings of the host's terminal that may have changed the bytes received last; empty: raw
  /// mode, or no terminal.
  virtual const TerminalFlags& host_flags() const { return kRaw; }

 private:
  inline static const TerminalFlags kRaw;

  virtual Batch next_batch(Wait wait) = 0;
  virtual void note_error(int /*error*/) {}
};

/// Calls `on_readable` whenever a descriptor is readable. Does not close the descriptor: its owner
/// does, after `release`.
class Readiness {
 public:
  Readiness(boost::asio::io_context& loop, std::function<void()> on_readable)
      : descriptor_(loop), on_readable_(std::move(on_readable)) {}
  Readiness(const Readiness&) = delete;
  Readiness& operator=(const Readiness&) = delete;
  ~Readiness() { release(); }

  /// Starts to watch `fd`. Returns the error if that fails.
  boost::system::error_code watch(int fd) {
    boost::system::error_code error;
    descriptor_.assign(fd, error);
    if (!error) wait();
    return error;
  }
  void release() {
    ++generation_;
    if (descriptor_.is_open()) descriptor_.release();
  }
  /// Calls back once when the descriptor is writable; never after `release`.
  void when_writable(std::function<void()> on_writable) {
    using boost::asio::posix::stream_descriptor;
    descriptor_.async_wait(stream_descriptor::wait_write,
                           [this, mine = generation_, on_writable = std::move(on_writable)](
                               const boost::system::error_code& error) {
                             if (!error && mine == generation_) on_writable();
                           });
  }

 private:
  void wait() {
    using boost::asio::posix::stream_descriptor;
    descriptor_.async_wait(stream_descriptor::wait_read,
                           [this, mine = generation_](const boost::system::error_code& error) {
                             if (error || mine != generation_) return;
                             on_readable_();
                             if (mine == generation_) wait();
                           });
  }

  boost::asio::posix::stream_descriptor descriptor_;
  std::function<void()> on_readable_;
  unsigned generation_ = 0;  // number of the descriptor: callbacks for earlier ones are ignored
};

/// Creates the port that the name of the bus selects. The port calls `on_frames` when there may be
/// frames to `receive`. Throws StartError.
std::unique_ptr<Port> make_port(boost::asio::io_context& loop, const BusConfig& bus,
                                Interfaces allowed, std::function<void()> on_frames);

/// Checks that a bus with a path can be created there; ignores other buses. Throws StartError.
void check_place(const std::string& bus);
/// Returns the canonical name of a bus, for locks: two names of the same bus give the same result.
std::string place_of(const std::string& bus);

}  // namespace lk::emulator

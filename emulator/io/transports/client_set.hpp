#pragma once

/// Clients of a bus over TCP or a pseudo-terminal, and the protocol of each.

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/config/bus_name.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/io/transports/port.hpp"
#include "emulator/io/transports/socket_listener.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Contents of a client's bytes.
struct ParsedInput {
  std::vector<protocol::Frame> frames;  // for the bus
  std::string response;                 // for the client
  std::string warning;                  // for the log; empty: none
  std::uint64_t malformed = 0;          // number of malformed lines
  std::size_t room = SIZE_MAX;          // frames that the hosts' queue still takes

  /// Takes a frame for the bus. Returns false if the queue has no room.
  bool take(const protocol::Frame& frame) {
    if (frames.size() >= room) return false;
    frames.push_back(frame);
    return true;
  }
};

/// Protocol of one client: converts its bytes to frames and answers, and frames of the bus to
/// bytes. Uses neither sockets nor clocks. All times are readings of the wall clock.
class ClientProtocol {
 public:
  using Time = std::chrono::nanoseconds;

  ClientProtocol() = default;
  ClientProtocol(const ClientProtocol&) = delete;
  ClientProtocol& operator=(const ClientProtocol&) = delete;
  virtual ~ClientProtocol() = default;

  /// Returns the first bytes sent to a new client.
  virtual std::string greeting() const { return ""; }
  /// Parses bytes received at `now`, in pieces of any size; appends to `parsed`.
  virtual void parse(std::span<const std::uint8_t> bytes, Time now, ParsedInput& parsed) = 0;
  /// Appends the bytes by which the client learns of a frame on the bus at `now`.
  virtual void encode(const protocol::Frame& frame, Time now, std::string& out) = 0;
  /// Records that frames or answers for the client were lost, so that it can ask for that.
  virtual void note_loss() {}
  /// Returns when the next of the client's cyclic frames is due; nullopt: there is none.
  virtual std::optional<Time> next_due() const { return std::nullopt; }
  /// Appends the cyclic frames that are due by `now`.
  virtual void take_due(Time /*now*/, std::vector<protocol::Frame>& /*out*/) {}
};

/// Splits a byte stream into lines; keeps an incomplete line for the next call.
class LineBuffer {
 public:
  /// `longest`: limit for a line, without its end character.
  LineBuffer(char end, std::size_t longest) : end_(end), longest_(longest) {}

  /// Calls `on_line(std::string_view)` for each line, and `on_too_long()` at the end of each line
  /// over the limit, which is discarded.
  template <class OnLine, class OnTooLong>
  void split(std::span<const std::uint8_t> bytes, OnLine on_line, OnTooLong on_too_long) {
    for (const std::uint8_t byte : bytes) {
      const char c = static_cast<char>(byte);
      if (c != end_) {
        too_long_ = too_long_ || line_.size() == longest_;
        if (!too_long_) line_ += c;
        continue;
      }
      if (too_long_) {
        on_too_long();
      } else {
        on_line(std::string_view(line_));
      }
      line_.clear();
      too_long_ = false;
    }
  }

 private:
  char end_;
  std::size_t longest_;
  std::string line_;
  bool too_long_ = false;
};

/// Enables keep-alive for connections accepted at this TCP socket. A connection ends within a
/// minute if its peer loses power or network, also while a reply is unacknowledged. A connection
/// also ends if its peer reads nothing for a minute after its buffers are full.
void keep_connections_alive(int listening_socket);

/// A bus whose hosts use a client protocol over TCP or a pseudo-terminal.
struct StreamSetup {
  std::size_t most_clients;
  std::string refusal;  // sent to a client when the port is full
  std::function<std::unique_ptr<ClientProtocol>()> make_protocol;  // for a new client
  bool beacon = false;                                             // announces the port (Beacon)
};
/// `name`: name of the bus; `place`: the parsed name. Throws StartError.
std::unique_ptr<Port> make_stream_port(boost::asio::io_context& loop, const std::string& name,
                                       const BusName& place, StreamSetup setup,
                                       std::function<void()> on_frames);

/// Clients of a port, each with a descriptor and a protocol. No client can block others or grow
/// memory without bound: one that does not read loses frames. A client that has closed its sending
/// side still gets replies; it is removed after kLastReply without a write to it.
class ClientSet {
 public:
  /// Unsent bytes kept for a client beyond the kernel's buffer: about 0.25 s of a full CAN bus.
  static constexpr std::size_t kMaxUnsent = std::size_t{64} * 1024;
  /// Reserve for answers once `kMaxUnsent` is used up, such as the overrun flag.
  static constexpr std::size_t kMaxAnswers = std::size_t{4} * 1024;

  /// Longer than any reply takes (assumed). Also a client that has closed both sides is only
  /// removed after this time, unless TCP resets the connection earlier.
  static constexpr std::chrono::seconds kLastReply{1};

  /// `name`: name of the bus, for the log. Throws StartError.
  explicit ClientSet(std::string name);

  /// Descriptor that is readable when a client or a watched descriptor has data, or a frame is due.
  int descriptor() const { return epoll_.get(); }
  /// Also watches `fd`; `collect` reports it in `watched`.
  void watch(int fd);
  void ignore(int fd);

  /// Adds a client; closes `fd` when it removes the client.
  void add(Descriptor fd, std::string peer, std::unique_ptr<ClientProtocol> protocol);
  /// Adds a client whose descriptor is closed by its owner.
  void add_lent(int fd, std::string peer, std::unique_ptr<ClientProtocol> protocol);
  std::size_t size() const { return clients_.size(); }
  /// Removes the clients that have closed their sending side, without waiting for kLastReply.
  void drop_finished();

  struct Collected {
    bool watched = false;  // a watched descriptor is readable
    bool more = false;     // clients may have more data
  };
  /// Appends frames from clients to `out`; waits at most `timeout` for data.
  Collected collect(std::vector<ReceivedFrame>& out,
                    std::chrono::milliseconds timeout = std::chrono::milliseconds(0));
  /// Queues frames for all clients except number `except` (0: for all). `flush` sends them later:
  /// one system call for many frames.
  void queue_frames(std::span<const protocol::Frame> frames, std::uint32_t except);

  /// Limits the frames that clients can send until the next call.
  void set_room(std::size_t frames) { room_ = frames; }
  /// Removes all clients.
  void clear() { clients_.clear(); }

  /// Sends queued bytes and acknowledges received ones.
  void flush();

  /// Only `lost_unread` and `malformed` are counted.
  const PortStats& stats() const { return stats_; }

 private:
  struct Client {
    std::uint32_t number = 0;
    Descriptor own;
    int fd = -1;
    std::string peer;
    std::unique_ptr<ClientProtocol> protocol;
    std::string unsent;
    bool ack_pending = false;  // received bytes are not yet acknowledged (TCP)
    bool wants_write = false;  // waits for room in the kernel's send buffer
    bool is_losing = false;    // frames for it are being lost; the warning is logged
    bool warned = false;       // a warning of its protocol is already logged
    // Removal time: set when the client closes its sending side, postponed by each write to it.
    std::optional<ClientProtocol::Time> leaves_at = std::nullopt;
  };
  using Clients = std::map<std::uint32_t, Client>;

  void add(Client client);
  /// Returns false if the client has gone.
  bool read_from(Client& client, std::vector<ReceivedFrame>& out, bool& more);
  /// Timer callback: collects frames that are due, and removes clients whose `leaves_at` is
  /// reached.
  void on_timer(std::vector<ReceivedFrame>& out);
  void take_due(Client& client, std::vector<ReceivedFrame>& out);
  void queue_frames(Client& client, std::span<const protocol::Frame> frames);
  void put(Client& client, std::string_view bytes, std::size_t most);
  /// Sends as much as the kernel takes; returns false if the client has gone.
  bool flush(Client& client);
  void wait_for_room(Client& client, bool wants_write);
  void set_interest(const Client& client);
  void arm_timer();

  std::string name_;
  LogLimit log_limit_;
  Descriptor epoll_;
  Descriptor timer_;  // for due frames and removals
  std::optional<ClientProtocol::Time> timer_at_;
  Clients clients_;  // by number, which is `sender` in frames
  std::uint32_t last_number_ = 0;
  std::size_t room_ = SIZE_MAX;
  PortStats stats_;
  std::vector<std::uint8_t> bytes_;
  std::string encoded_;
  ParsedInput parsed_;
};

}  // namespace lk::emulator

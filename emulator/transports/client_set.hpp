#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "emulator/files/durable_file.hpp"
#include "emulator/transports/client_protocol.hpp"
#include "emulator/transports/port.hpp"
#include "emulator/transports/tell_limit.hpp"

namespace lk::emulator {

/// The clients of a port, each a descriptor and a protocol. None can block the others or grow
/// without bound: one that does not read loses frames. A client that has closed its sending side
/// still gets its replies. It is removed when nothing has been sent to it for kLastReply.
class ClientSet {
 public:
  /// Bytes kept for a client beyond what the kernel keeps: about a quarter of a second of a full
  /// CAN bus.
  static constexpr std::size_t kMostUnsent = std::size_t{64} * 1024;
  /// And above them, so that one which has lost frames can be told that.
  static constexpr std::size_t kMostAnswers = std::size_t{4} * 1024;

  /// Longer than any reply takes. A client that has closed both sides keeps its place that long,
  /// unless TCP resets the connection before (assumed).
  static constexpr std::chrono::seconds kLastReply{1};

  /// `name` is the bus's. Throws StartError.
  explicit ClientSet(std::string name);

  /// Can be read when a client has something to say, or something watched has.
  int descriptor() const { return epoll_.get(); }
  /// Another descriptor, beside the clients'; `collect` tells of it.
  void watch(int fd);
  void ignore(int fd);

  /// It is closed with the client.
  void add(Descriptor fd, std::string who, std::unique_ptr<ClientProtocol> protocol);
  /// A descriptor that its owner closes.
  void add_lent(int fd, std::string who, std::unique_ptr<ClientProtocol> protocol);
  std::size_t size() const { return clients_.size(); }
  /// Removes the clients that have closed their sending side.
  void drop_finished();

  struct Collected {
    bool watched = false;  // a watched descriptor has something
    bool more = false;     // clients may have more to say
  };
  /// What clients have said, appended to `out`; waits that long for something to be there.
  Collected collect(std::vector<ReceivedFrame>& out,
                    std::chrono::milliseconds patience = std::chrono::milliseconds(0));
  /// To all but the client `except`; 0: to all. It leaves with `flush`, so that a system call
  /// serves as many frames as there are.
  void tell(std::span<const protocol::Frame> frames, std::uint32_t except);

  /// Frames and answers leave, and what has come is acknowledged.
  void flush();

  /// `lost_unread` and `malformed`.
  const PortStats& stats() const { return stats_; }

 private:
  struct Client {
    std::uint32_t number = 0;
    Descriptor own;
    int fd = -1;
    std::string who;
    std::unique_ptr<ClientProtocol> protocol;
    std::string unsent;
    bool unheard = false;   // bytes of it that its kernel has not been told of
    bool waits = false;     // for room to send
    bool loses = false;     // frames, and that was said
    bool troubled = false;  // and that was said
    // Set when the client has closed its sending side: removal time, moved on by each write to it.
    std::optional<ClientProtocol::Time> leaves_at = std::nullopt;
  };
  using Clients = std::map<std::uint32_t, Client>;

  void add(Client client);
  /// False: the client has gone.
  bool listen_to(Client& client, std::vector<ReceivedFrame>& out, bool& more);
  /// The timer has expired: frames that protocols have due, clients that leave.
  void take_alarm(std::vector<ReceivedFrame>& out);
  void take_due(Client& client, std::vector<ReceivedFrame>& out);
  void show(Client& client, std::span<const protocol::Frame> frames);
  void put(Client& client, std::string_view bytes, std::size_t most);
  /// As much as goes; false: the client has gone.
  bool flush(Client& client);
  void wait_for_room(Client& client, bool waits);
  void set_interest(const Client& client);
  void set_alarm();

  std::string name_;
  TellLimit trouble_;
  Descriptor epoll_;
  Descriptor alarm_;  // for what protocols have due
  std::optional<ClientProtocol::Time> alarm_at_;
  Clients clients_;  // by number, which is their sender's
  std::uint32_t last_number_ = 0;
  PortStats stats_;
  std::vector<std::uint8_t> bytes_;
  std::string shown_;
  FromClient heard_;
};

}  // namespace lk::emulator

#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/bus_name.hpp"
#include "emulator/transports/beacon.hpp"
#include "emulator/transports/client_set.hpp"
#include "emulator/transports/pty_link.hpp"

namespace lk::emulator {

/// A bus whose hosts come over TCP, or by a pseudo-terminal, with the bytes of some protocol.
class StreamPort final : public Port {
 public:
  /// A protocol for the next client.
  using Meet = std::function<std::unique_ptr<ClientProtocol>()>;
  struct Setup {
    BusName place;
    std::size_t most_clients;
    std::string refusal;  // what one is told for whom there is no room
    Meet meet;
    bool beacon = false;
  };

  /// `name` is the bus's. `on_frames` is called when there may be something to `receive`. Throws
  /// StartError.
  StreamPort(boost::asio::io_context& loop, const std::string& name, Setup setup,
             std::function<void()> on_frames);
  StreamPort(const StreamPort&) = delete;
  StreamPort& operator=(const StreamPort&) = delete;
  ~StreamPort() override;

  void check_link() override;
  bool is_up() const override { return true; }
  bool can_wait() const override {
    return !pty_;
  }  // a wait does not end when a host opens the terminal
  void send(std::span<const protocol::Frame> frames) override;
  void pass_on(const protocol::Frame& frame, std::uint32_t sender) override;
  void end_turn() override { clients_.flush(); }
  int descriptor() const override { return clients_.descriptor(); }
  /// A client that does not read loses frames; nothing waits for it.
  std::size_t pending() const override { return 0; }
  PortStats stats() const override;

 private:
  Batch next_batch(Wait wait) override;
  void note_error(int /*error*/) override {}
  void listen(boost::asio::io_context& loop);
  void let_in();
  void wait_readable();

  std::string name_;
  Setup setup_;
  std::function<void()> on_frames_;
  std::optional<PtyLink> pty_;
  ClientSet clients_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::posix::stream_descriptor readiness_;  // watches the clients, who own the descriptor
  std::optional<Beacon> beacon_;
  std::uint64_t sent_ = 0;
  std::uint64_t refused_ = 0;
  std::vector<ReceivedFrame> received_;
};

}  // namespace lk::emulator

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
#include "emulator/io/transports/client_set.hpp"
#include "emulator/io/transports/pty_link.hpp"
#include "emulator/io/transports/socketcand.hpp"

namespace lk::emulator {

/// A bus whose hosts use a client protocol over TCP or a pseudo-terminal.
class StreamPort final : public Port {
 public:
  /// Creates the protocol of a new client.
  using MakeProtocol = std::function<std::unique_ptr<ClientProtocol>()>;
  struct Setup {
    BusName place;
    std::size_t most_clients;
    std::string refusal;  // sent to a client when the port is full
    MakeProtocol make_protocol;
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
  bool can_wait() const override { return !pty_; }  // opening the terminal would not end a wait
  void send(std::span<const protocol::Frame> frames) override;
  void pass_on(const protocol::Frame& frame, std::uint32_t sender) override;
  void end_turn() override { clients_.flush(); }
  int descriptor() const override { return clients_.descriptor(); }
  /// Always 0: a client that does not read loses frames.
  std::size_t pending() const override { return 0; }
  PortStats stats() const override;

 private:
  Batch next_batch(Wait wait) override;
  void note_error(int /*error*/) override {}
  void listen(boost::asio::io_context& loop);
  void accept_clients();
  void wait_readable();

  std::string name_;
  Setup setup_;
  std::function<void()> on_frames_;
  std::optional<PtyLink> pty_;
  ClientSet clients_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::posix::stream_descriptor readiness_;  // watches `clients_`, the owner
  std::optional<Beacon> beacon_;
  std::uint64_t sent_ = 0;
  std::uint64_t refused_ = 0;
  std::vector<ReceivedFrame> received_;
};

}  // namespace lk::emulator

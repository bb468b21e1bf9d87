#include "emulator/io/transports/stream_port.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/client_set.hpp"

namespace lk::emulator {

using boost::asio::ip::tcp;

StreamPort::StreamPort(boost::asio::io_context& loop, const std::string& name, Setup setup,
                       std::function<void()> on_frames)
    : name_(name),
      setup_(std::move(setup)),
      on_frames_(std::move(on_frames)),
      clients_(name),
      acceptor_(loop),
      readiness_(loop) {
  if (setup_.place.scheme->place == BusPlace::kPath) {
    pty_.emplace(loop, name_, setup_.place.path, true);
    clients_.add_lent(pty_->descriptor(), setup_.place.path, setup_.make_protocol());
  } else {
    listen(loop);
  }
  boost::system::error_code error;
  readiness_.assign(clients_.descriptor(), error);
  if (error) throw StartError(name_ + ": " + error.message());
  wait_readable();
}

StreamPort::~StreamPort() {
  if (readiness_.is_open()) readiness_.release();  // its owner closes the descriptor
}

void StreamPort::listen(boost::asio::io_context& loop) {
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(setup_.place.address, error);
  if (error) throw StartError(name_ + ": " + setup_.place.address + " is not an IP address");
  const tcp::endpoint endpoint(address, setup_.place.port);
  try {
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
    acceptor_.non_blocking(true);
    keep_connections_alive(acceptor_.native_handle());
  } catch (const boost::system::system_error& problem) {
    throw StartError(name_ + ": cannot listen there: " + problem.code().message());
  }
  if (!address.is_loopback()) {
    spdlog::warn("{}: anyone who can reach {} can command these drives{}", name_,
                 setup_.place.address,
                 address.is_unspecified() ? ", which is all addresses of this machine" : "");
  }
  clients_.watch(acceptor_.native_handle());
  if (setup_.beacon && address.is_v4() && !address.is_unspecified()) {
    beacon_.emplace(loop, address.to_v4(), setup_.place.port);
  }
}

/// Accepts waiting clients; at most 64 per call, the others wait for the next batch.
void StreamPort::accept_clients() {
  constexpr int kMaxAtOnce = 64;
  for (int n = 0; n < kMaxAtOnce; ++n) {
    boost::system::error_code error;
    tcp::endpoint from;
    tcp::socket socket(acceptor_.get_executor());
    acceptor_.accept(socket, from, error);
    if (error == boost::asio::error::would_block) return;
    if (error) {  // no descriptors left, for example: paused until check_link
      clients_.ignore(acceptor_.native_handle());
      return;
    }
    if (clients_.size() >= setup_.most_clients) clients_.drop_finished();
    if (clients_.size() >= setup_.most_clients) {
      if (refused_++ == 0) {
        spdlog::warn("{}: {} clients, the limit: others are refused", name_, setup_.most_clients);
      }
      socket.write_some(boost::asio::buffer(setup_.refusal), error);
      continue;
    }
    socket.set_option(tcp::no_delay(true), error);
    socket.native_non_blocking(true, error);
    const std::string peer = from.address().to_string() + " port " + std::to_string(from.port());
    clients_.add(Descriptor(socket.release()), peer, setup_.make_protocol());
  }
}

void StreamPort::check_link() {
  if (acceptor_.is_open()) clients_.watch(acceptor_.native_handle());
  if (beacon_) beacon_->send_if_due();
}

void StreamPort::wait_readable() {
  readiness_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [this](const boost::system::error_code& error) {
                          if (error) return;
                          on_frames_();
                          wait_readable();
                        });
}

Port::Batch StreamPort::next_batch(Wait wait) {
  received_.clear();
  const ClientSet::Collected collected = clients_.collect(
      received_,
      std::chrono::ceil<std::chrono::milliseconds>(
          wait == Wait::kForOne ? CanSocket::kReceiveTimeout : CanSocket::kReceiveTimeout.zero()));
  if (pty_) pty_->handle_host_events();
  if (collected.watched) accept_clients();  // their first bytes may be there already
  return {received_, collected.more || collected.watched, 0};
}

void StreamPort::send(std::span<const protocol::Frame> frames) {
  sent_ += frames.size();
  clients_.queue_frames(frames, 0);
}

void StreamPort::pass_on(const protocol::Frame& frame, std::uint32_t sender) {
  clients_.queue_frames({&frame, 1}, sender);
}

PortStats StreamPort::stats() const {
  PortStats stats = clients_.stats();
  stats.sent = sent_;
  stats.refused = refused_;
  return stats;
}

}  // namespace lk::emulator

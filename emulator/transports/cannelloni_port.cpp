#include "emulator/transports/cannelloni_port.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <utility>

#include "emulator/ground/start_error.hpp"
#include "emulator/transports/own_addresses.hpp"
#include "emulator/transports/wall_clock.hpp"

namespace lk::emulator {

using boost::asio::ip::udp;
namespace ip = boost::asio::ip;

CannelloniPort::CannelloniPort(boost::asio::io_context& loop, const std::string& name,
                               const BusName& place, std::function<void()> on_frames)
    : DatagramPort(loop, name, kLongestCannelloni, std::move(on_frames)) {
  boost::system::error_code error;
  const auto address = ip::make_address(place.address, error);
  if (error) throw StartError(name_ + ": " + place.address + " is no IP address");
  if (place.port == place.local_port &&
      addresses_of_this_machine().contains(without_scope(address))) {
    throw StartError(name_ + ": " + place.address +
                     " is this machine, so the two ends cannot have the same port: give ?local=" +
                     "PORT another");
  }
  peer_ = {address, place.port};
  udp::endpoint own(peer_.protocol(), place.local_port);
  if (address.is_loopback()) own.address(address);  // out of reach of other machines
  try {
    socket_.open(own.protocol());
    socket_.bind(own);
  } catch (const boost::system::system_error& problem) {
    throw StartError(name_ + ": cannot have UDP port " + std::to_string(place.local_port) + ": " +
                     problem.code().message());
  }
  if (!address.is_loopback()) {
    spdlog::warn(
        "{}: whoever can send from {}, or as if from there, to UDP port {} of this machine can "
        "command these drives",
        name_, place.address, place.local_port);
  }
  listen();
}

bool CannelloniPort::is_peer(const Endpoint& from) {
  if (from == peer_) return true;
  if (stats_.foreign++ == 0) {
    spdlog::warn("{}: {} port {} is not the other end: its frames are dropped", name_,
                 from.address().to_string(), from.port());
  }
  return false;
}

void CannelloniPort::take(std::span<const std::uint8_t> datagram, const Endpoint& from,
                          std::vector<ReceivedFrame>& out) {
  if (!is_peer(from)) return;
  const auto packet = parse_cannelloni(datagram);
  if (!packet) {
    ++stats_.malformed;
    return;
  }
  if (const unsigned missed = missed_.before(packet->sequence)) {
    if (stats_.lost_datagrams == 0) {
      spdlog::warn("{}: {} datagrams of the other end did not come: their frames are lost", name_,
                   missed);
    }
    stats_.lost_datagrams += missed;
  }
  const auto stamp = wall_now();
  for (const protocol::Frame& frame : packet->frames) out.push_back({stamp, frame});
}

/// Nothing waits to be sent together with what comes later, as cannelloni has it.
void CannelloniPort::send(std::span<const protocol::Frame> frames) {
  while (!frames.empty()) {
    const auto some = frames.first(std::min(frames.size(), kMostCannelloniFrames));
    frames = frames.subspan(some.size());
    boost::system::error_code error;
    socket_.send_to(boost::asio::buffer(cannelloni_packet(some, sequence_++)), peer_, 0, error);
    const bool full = error == boost::asio::error::would_block;
    if (error && !full && stats_.lost_link_down == 0) {
      spdlog::warn("{}: cannot send to {}: {}; replies are lost while this lasts", name_,
                   peer_.address().to_string(), error.message());
    }
    (!error ? stats_.sent : full ? stats_.lost_queue_full : stats_.lost_link_down) += some.size();
  }
}

}  // namespace lk::emulator

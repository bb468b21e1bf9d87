#include "emulator/transports/datagram_port.hpp"

#include <boost/asio/buffer.hpp>
#include <utility>

namespace lk::emulator {
namespace {

constexpr std::size_t kMostDatagrams = 64;  // at once

}  // namespace

using boost::asio::ip::udp;

DatagramPort::DatagramPort(boost::asio::io_context& loop, std::string name, std::size_t longest,
                           std::function<void()> on_frames)
    : name_(std::move(name)),
      socket_(loop),
      on_frames_(std::move(on_frames)),
      bytes_(longest + 1) {}

void DatagramPort::listen() {
  socket_.non_blocking(true);
  descriptor_ = socket_.native_handle();
  wait_readable();
}

void DatagramPort::wait_readable() {
  socket_.async_wait(udp::socket::wait_read, [this](const boost::system::error_code& error) {
    if (error) return;
    on_frames_();
    wait_readable();
  });
}

Port::Batch DatagramPort::next_batch(Wait /*wait*/) {
  received_.clear();
  for (std::size_t n = 0; n < kMostDatagrams; ++n) {
    Endpoint from;
    boost::system::error_code error;
    const std::size_t size = socket_.receive_from(boost::asio::buffer(bytes_), from, 0, error);
    if (error) return {received_, false, 0};
    take({bytes_.data(), size}, from, received_);
  }
  return {received_, true, 0};
}

}  // namespace lk::emulator

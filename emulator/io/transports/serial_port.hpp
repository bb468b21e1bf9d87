#pragma once

#include "emulator/io/transports/client_set.hpp"
#include "emulator/io/transports/port.hpp"

namespace lk::emulator {

/// RS-485 over TCP: carries the bytes of packets unchanged in both directions.
class SerialBytes final : public ClientProtocol {
 public:
  void parse(std::span<const std::uint8_t> bytes, Time now, ParsedInput& parsed) override;
  void encode(const protocol::Frame& frame, Time now, std::string& out) override;
};

/// Creates the port of an RS-485 bus: a pseudo-terminal with a link at `path`, or a real serial
/// port if there is one at `path`. On the modelled wire, the bytes of one write follow each other
/// without a gap, from their arrival on. Pre: `bus.serial`. Throws StartError.
std::unique_ptr<Port> make_serial_port(boost::asio::io_context& loop, const BusConfig& bus,
                                       const std::string& path, std::function<void()> on_frames);

}  // namespace lk::emulator

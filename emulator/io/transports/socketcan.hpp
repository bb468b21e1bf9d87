#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>

#include "emulator/io/transports/port.hpp"

namespace lk::emulator {

/// Returns why CAN sockets are not available; empty if they are.
std::string can_problem();

/// Creates the port of one CAN interface. If the interface goes down or vanishes, the port
/// continues when it is back. Replies leave in order and wait while the send queue is full. The
/// port is closed until the first `check_link`.
std::unique_ptr<Port> make_socketcan_port(boost::asio::io_context& loop, const BusConfig& bus,
                                          Interfaces allowed, std::function<void()> on_frames);

}  // namespace lk::emulator

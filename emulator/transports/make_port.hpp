#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>

#include "emulator/core/bus_config.hpp"
#include "emulator/transports/netlink.hpp"
#include "emulator/transports/port.hpp"

namespace lk::emulator {

/// The port that the name of the bus says. `on_frames` is called when there may be something to
/// `receive`. Throws StartError.
std::unique_ptr<Port> make_port(boost::asio::io_context& loop, const BusConfig& bus,
                                Interfaces allowed, std::function<void()> on_frames);

/// Whether the bus, no interface, could be made where its name says. Throws StartError.
void check_place(const std::string& bus);
/// What the name stands for, so that two names of one place are one: for locks.
std::string place_of(const std::string& bus);

}  // namespace lk::emulator

#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>

#include "emulator/core/bus_config.hpp"
#include "emulator/io/transports/netlink.hpp"
#include "emulator/io/transports/port.hpp"

namespace lk::emulator {

/// Creates the port that the name of the bus selects. `on_frames` is called when there may be
/// something to `receive`. Throws StartError.
std::unique_ptr<Port> make_port(boost::asio::io_context& loop, const BusConfig& bus,
                                Interfaces allowed, std::function<void()> on_frames);

/// Checks that a bus with a path can be created there; ignores other buses. Throws StartError.
void check_place(const std::string& bus);
/// Returns one name for each place, for locks: two names of one place give the same result.
std::string place_of(const std::string& bus);

}  // namespace lk::emulator

#include "emulator/io/transports/port.hpp"

#include <filesystem>
#include <utility>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/multicast_port.hpp"
#include "emulator/io/transports/serial_port.hpp"
#include "emulator/io/transports/slcan.hpp"
#include "emulator/io/transports/socketcan.hpp"
#include "emulator/io/transports/socketcand.hpp"
#include "emulator/io/transports/terminal.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kMaxPlaceLength = 85;
/// Limit for the clients of one bus; a robot's bus has few hosts.
constexpr std::size_t kMaxClients = 32;

}  // namespace

std::unique_ptr<Port> make_port(boost::asio::io_context& loop, const BusConfig& bus,
                                Interfaces allowed, std::function<void()> on_frames) {
  const BusName name = bus_name(bus.interface);
  const auto stream = [&](StreamSetup setup) {
    return make_stream_port(loop, bus.interface, name, std::move(setup), std::move(on_frames));
  };
  switch (name.scheme->transport) {
    case Transport::kSocketCan:
      return make_socketcan_port(loop, bus, allowed, std::move(on_frames));
    case Transport::kRs485:
      return make_serial_port(loop, bus, name.path, std::move(on_frames));
    case Transport::kSlcanTcp:
    case Transport::kSlcanPty:
      return stream({kMaxClients, "\a", [bitrate = bus.bitrate, acks = name.acks] {
                       return std::make_unique<Slcan>(bitrate, acks);
                     }});
    case Transport::kSocketcand:
      return stream({kMaxClients, "< error too many clients >",
                     [] { return std::make_unique<Socketcand>(); }, true});
    case Transport::kUdpMulticast:
      return make_multicast_port(loop, bus.interface, name, std::move(on_frames));
    case Transport::kRs485Tcp:
      return stream({1, "lk-emu: this line has its one host already\n",
                     [] { return std::make_unique<SerialBytes>(); }});
  }
  return nullptr;
}

void check_place(const std::string& bus) {
  const BusName name = bus_name(bus);
  if (name.scheme->place != BusPlace::kPath) return;
  check_terminal_path(bus, name.path);
  if (name.scheme->transport == Transport::kSlcanPty && is_serial_device(name.path)) {
    throw StartError(
        bus + ": " + name.path +
        " is a serial port; slcan-pty creates its own terminal: give a path that does not exist");
  }
}

std::string place_of(const std::string& bus) {
  const BusName name = bus_name(bus);
  if (name.scheme->place == BusPlace::kInterface) return bus;
  if (name.scheme->place != BusPlace::kPath) {
    return std::string(name.scheme->prefix) + name.address + ":" + std::to_string(name.port);
  }
  // Serial port: path of the device, links resolved. Pseudo-terminal: path of the link itself.
  const std::filesystem::path path(name.path);
  std::error_code error;
  const auto place = is_serial_device(name.path)
                         ? std::filesystem::canonical(path, error)
                         : std::filesystem::weakly_canonical(
                               std::filesystem::absolute(path).parent_path(), error) /
                               path.filename();
  const std::string text = error ? name.path : place.string();
  // The name of a lock must fit into a socket address.
  return text.size() <= kMaxPlaceLength ? "path:" + text
                                        : "path:" + std::to_string(std::hash<std::string>{}(text));
}

}  // namespace lk::emulator

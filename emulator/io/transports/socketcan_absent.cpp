// Replaces socketcan.cpp on systems without CAN headers.

#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/socketcan.hpp"

namespace lk::emulator {

std::string can_problem() { return "this lk-emu is built without SocketCAN"; }

std::unique_ptr<Port> make_socketcan_port(boost::asio::io_context& /*loop*/,
                                          const BusConfig& /*bus*/, Interfaces /*allowed*/,
                                          std::function<void()> /*on_frames*/) {
  throw StartError(can_problem());
}

}  // namespace lk::emulator

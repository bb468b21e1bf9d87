// Replaces socketcan.cpp on systems without CAN headers.

#include <cerrno>
#include <system_error>

#include "emulator/io/transports/socketcan.hpp"

namespace lk::emulator {

struct CanSocket::Buffers {};
struct CanSocket::Outgoing {};

std::string can_problem() { return "this lk-emu is built without SocketCAN"; }

CanSocket::CanSocket(int /*interface_index*/, Reception /*reception*/) : fd_(-1) {
  throw std::system_error(EAFNOSUPPORT, std::generic_category(), "SocketCAN");
}
CanSocket::~CanSocket() = default;
CanSocket::Batch CanSocket::receive(Wait /*wait*/) { return {}; }
void CanSocket::set_blocking() {}
CanSocket::Sent CanSocket::send(std::span<const protocol::Frame> /*frames*/) {
  return {0, SendResult::kLinkDown};
}

}  // namespace lk::emulator

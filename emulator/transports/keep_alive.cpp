#include "emulator/transports/keep_alive.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

namespace lk::emulator {
namespace {

/// The kernel does not probe a connection while a reply is unacknowledged: it repeats the reply for
/// about 15 min. This limit equals the time to the last probe of an idle connection.
constexpr int kAcknowledgeTimeout_ms = 60'000;

}  // namespace

void keep_connections_alive(int listening_socket) {
  // Assumed: a person who restarts a host waits no longer than a minute.
  constexpr struct {
    int level, option, value;
  } kSettings[] = {{SOL_SOCKET, SO_KEEPALIVE, 1},
                   {IPPROTO_TCP, TCP_KEEPIDLE, 30},   // seconds of silence before the first probe
                   {IPPROTO_TCP, TCP_KEEPINTVL, 10},  // seconds between probes
                   {IPPROTO_TCP, TCP_KEEPCNT, 3},     // probes without an answer
                   {IPPROTO_TCP, TCP_USER_TIMEOUT, kAcknowledgeTimeout_ms}};
  for (const auto& [level, option, value] : kSettings) {
    ::setsockopt(listening_socket, level, option, &value, sizeof value);
  }
}

}  // namespace lk::emulator

#pragma once

namespace lk::emulator {

/// Enables keep-alive for connections accepted at this TCP socket. A connection ends within a
/// minute if its peer loses power or network, also while a reply is unacknowledged. A connection
/// also ends if its peer reads nothing for a minute after its buffers are full.
void keep_connections_alive(int listening_socket);

}  // namespace lk::emulator

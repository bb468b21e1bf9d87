#pragma once

namespace lk::emulator {

/// Connections accepted at this TCP socket inherit keep-alive: one whose peer has lost power or
/// network ends within a minute, also while a reply is under way, and frees its place. A connection
/// whose peer reads nothing for a minute after its buffers are full ends too.
void keep_connections_alive(int listening_socket);

}  // namespace lk::emulator

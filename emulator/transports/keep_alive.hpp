#pragma once

namespace lk::emulator {

/// Connections accepted at this TCP socket inherit keep-alive: one whose peer has lost power or
/// network ends after a minute without traffic, and frees its place.
void keep_connections_alive(int listening_socket);

}  // namespace lk::emulator

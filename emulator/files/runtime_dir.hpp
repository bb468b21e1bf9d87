#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lk::emulator {

/// Returns the directory for the sockets of running programs: $XDG_RUNTIME_DIR/lk-emu, or
/// /tmp/lk-emu-UID if $XDG_RUNTIME_DIR does not exist.
std::filesystem::path runtime_directory();

/// Creates the directory with mode 0700 if missing. Checks that only this user controls it: not a
/// link, own UID, no access for others. Throws StartError.
void secure_directory(const std::filesystem::path& directory);

/// Returns whether a process listens at this Unix socket. Throws StartError if this cannot be found
/// out, for example without free descriptors.
bool is_live_socket(const std::filesystem::path& path);

/// Returns the sockets in the runtime directory with a listening process, by name. Throws
/// StartError if another user controls the directory, as anyone may own its sockets then.
std::vector<std::filesystem::path> live_sockets();

/// Removes sockets of ended processes (BUS-PID.sock) from the runtime directory.
void remove_dead_sockets();

/// Removes a socket at `path` that a dead program left. Throws StartError if it is in use, belongs
/// to another user, or is not a socket.
void clear_stale_socket(const std::filesystem::path& path);

}  // namespace lk::emulator

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lk::emulator {

/// Directory for sockets of running programs: lk-emu in $XDG_RUNTIME_DIR, or /tmp/lk-emu-UID if
/// that does not exist.
std::filesystem::path runtime_directory();

/// Creates the directory and checks that only this user controls it: no link, own UID, mode 0700.
/// Throws StartError.
void secure_directory(const std::filesystem::path& directory);

/// Returns whether a process listens at this Unix socket. Throws StartError if that is unknown, for
/// example without free descriptors.
bool is_live_socket(const std::filesystem::path& path);

/// Returns the sockets in the runtime directory with a listening process, by name. Throws
/// StartError if another user controls the directory, as sockets may then be anyone's.
std::vector<std::filesystem::path> live_sockets();

/// Removes sockets of ended processes (BUS-PID.sock) from the runtime directory.
void remove_dead_sockets();

/// Removes a socket at `path` that a dead program left. Throws StartError if it is in use, or no
/// socket.
void clear_stale_socket(const std::filesystem::path& path);

}  // namespace lk::emulator

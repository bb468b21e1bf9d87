#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lk::emulator {

/// Where the sockets of running programs are: lk-emu in $XDG_RUNTIME_DIR, or, when there is no such
/// directory, /tmp/lk-emu-UID.
std::filesystem::path runtime_directory();

/// Makes it, and checks that nobody else has a hand in it: a directory, no link, ours, mode 0700.
/// Throws StartError.
void secure_directory(const std::filesystem::path& directory);

/// Whether somebody listens at this Unix socket. Throws StartError when there is no way to ask, as
/// without descriptors.
bool is_live_socket(const std::filesystem::path& path);

/// The sockets in the runtime directory that somebody listens at, by name. Throws StartError when
/// somebody else has a hand in it, as they may be anybody's.
std::vector<std::filesystem::path> live_sockets();

/// Removes the sockets, by name BUS-PID.sock, of processes that are no more from the runtime
/// directory.
void remove_dead_sockets();

/// Makes room for a socket at `path`: what a dead program left is removed. Throws StartError when
/// something else is there, or a live one.
void clear_stale_socket(const std::filesystem::path& path);

}  // namespace lk::emulator

#pragma once

#include <string>

namespace lk::emulator {

/// Runs `load` in a child process with limited memory and time. A model file may name a pipe as its
/// mesh, or ask for millions of bodies. Throws std::invalid_argument with the error of `load`
/// on one line, or the limit that was reached. `file` is the name for messages.
void try_in_child(const std::string& file, void (*load)(const std::string& file));

}  // namespace lk::emulator

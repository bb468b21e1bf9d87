#pragma once

#include <string>

namespace lk::emulator {

/// Runs `load` in a child process with bounded memory and time: a model file may name a pipe as its
/// mesh, or ask for millions of bodies. `load` throws what is wrong. Throws std::invalid_argument
/// with that on one line, or with the bound that was reached; `file` is the name for people.
void try_in_child(const std::string& file, void (*load)(const std::string& file));

}  // namespace lk::emulator

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lk::emulator {

/// Returns the directory `python` of an installation or of the sources, which has the package lkemu
/// and the examples. Empty if there is none, as for a program that a wheel has installed.
std::filesystem::path python_directory();

/// Replaces this process by the program `words[0]`, found in PATH, with the arguments `words`.
/// Returns only if that fails, with errno.
int become(std::vector<std::string> words);

}  // namespace lk::emulator

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lk::emulator {

/// Returns the directory `python` of an installation or of the sources, which has the package lkemu
/// and the examples. Empty where there is none, as beside a program that a wheel installed.
std::filesystem::path python_directory();

/// Replaces this process by the program `words[0]`, found in PATH. Returns errno if that fails.
int become(std::vector<std::string> words);

}  // namespace lk::emulator

#pragma once

#include <filesystem>
#include <string>

namespace lk::emulator {

/// The directory `python` of an installation or of the sources, which has the package lkemu and the
/// examples; empty where there is none, as beside a program that a wheel installed.
std::filesystem::path python_directory();

/// Replaces this process by `python3 -m MODULE`, a module of the package lkemu, with the arguments
/// of `argv` behind the word of the command. Python runs this program as $LKEMU. Throws StartError.
[[noreturn]] void become_python(const std::string& module, int argc, const char* const* argv);

}  // namespace lk::emulator

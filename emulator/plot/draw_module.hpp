#pragma once

/// @file What the module that draws offers. It is a file of its own, opened when something is to be
/// drawn, since Cairo and the thirty libraries behind it would cost every start of the program
/// time.

#include <string>

#include "emulator/plot/picture.hpp"

namespace lk::emulator {

enum class PictureFormat { kSvg, kPng };

struct DrawModule {
  const char* version;  // of the program that it belongs to
  /// Whether one font of this machine has all characters of a text, which is UTF-8.
  bool (*can_write)(const std::string& text);
  /// The file. Throws std::runtime_error.
  std::string (*draw)(const Picture& picture, PictureFormat format);
};

/// Name and type of what the module exports.
inline constexpr const char* kDrawModuleSymbol = "lk_emu_draw_module";

/// Opens it. Throws StartError.
const DrawModule& load_draw_module();

}  // namespace lk::emulator

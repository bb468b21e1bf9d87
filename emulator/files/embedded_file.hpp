#pragma once

#include <string_view>

namespace lk::emulator {

/// A file that is inside the program (cmake/EmbedFiles.cmake).
struct EmbeddedFile {
  std::string_view path;  // "/glance.js"
  std::string_view type;  // of its content
  std::string_view etag;  // changes with it
  std::string_view body;
};

}  // namespace lk::emulator

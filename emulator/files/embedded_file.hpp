#pragma once

#include <string_view>

namespace lk::emulator {

/// A file compiled into the program (cmake/EmbedFiles.cmake).
struct EmbeddedFile {
  std::string_view path;  // "/glance.js"
  std::string_view type;  // content type
  std::string_view etag;  // changes with the content
  std::string_view body;
};

}  // namespace lk::emulator

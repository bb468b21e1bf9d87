#pragma once

#include <string_view>

namespace lk::emulator {

/// A file of the dashboard (web/), as it is inside the program.
struct WebFile {
  std::string_view path;  // "/glance.js"
  std::string_view type;  // of its content
  std::string_view etag;  // changes with it
  std::string_view body;
};

/// What a browser asks for by `target`, which may have a "?…"; null: no file of the dashboard. "/"
/// is the page.
const WebFile* find_web_file(std::string_view target);

}  // namespace lk::emulator

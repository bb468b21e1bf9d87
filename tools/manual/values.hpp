#pragma once

#include <string>
#include <vector>

namespace lk::manual {

/// What can be offered for a value, by what --help calls it: "FILE", "on|off|cycle", "DIR|stop".
struct Choices {
  bool files = false;
  bool directories = false;
  bool interfaces = false;  // the CAN interfaces of the machine
  bool list = false;        // several of `words`, with commas between them
  std::vector<std::string> words;

  bool none() const { return !files && !directories && !interfaces && words.empty(); }
};

Choices choices_of(const std::string& value);

}  // namespace lk::manual

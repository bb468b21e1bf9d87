#pragma once

/// @file What the definitions of the command line say, as plain data: --help is made from the same.

#include <string>
#include <vector>

namespace lk::manual {

/// An option or a positional argument.
struct Argument {
  std::vector<std::string> names;  // "-h", "--help"; none of a positional
  std::string value;               // "FILE", "on|off|cycle"; empty: takes none
  std::string about;
  bool many = false;
  bool required = false;
};

/// lk-emu itself, or one of its words.
struct Word {
  std::string path;  // "lk-emu ctl fault"
  std::string about;
  std::vector<Argument> options;
  std::vector<Argument> positionals;
  bool takes_options_of_parent = false;
  std::vector<Word> words;
  std::vector<std::string> notes;  // paragraphs below the options
};

/// What follows the last blank: "fault".
std::string own_name(const Word& word);

/// All of it.
Word read_program();

}  // namespace lk::manual

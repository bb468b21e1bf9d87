#include <fmt/format.h>

#include "tools/manual/completions.hpp"
#include "tools/manual/values.hpp"

namespace lk::manual {
namespace {

constexpr const char* kBashHead =
    R"(# bash completion for lk-emu, made from what its --help is made from.
)";

/// Finds out where on the command line it is, and asks the tables above what may stand there.
constexpr const char* kBody = R"(
_lk_emu_offer() {
  local cur=$1 path type
  case ",$from," in *,files,*)
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$cur")
    ;;
  *,directories,*)
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -d -- "$cur")
    ;;
  esac
  if [[ ,$from, == *,interfaces,* ]]; then
    for path in /sys/class/net/*; do
      read -r type 2>/dev/null <"$path/type" && [[ $type == 280 ]] && choices+=" ${path##*/}"
    done
  fi
  if [[ ,$from, == *,list,* ]]; then
    local before=
    [[ $cur == *,* ]] && before=${cur%,*},
    compopt -o nospace 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -P "$before" -W "$choices" -- "${cur##*,}")
  else
    mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -W "$choices" -- "$cur")
  fi
}

_lk_emu() {
  local cur=${COMP_WORDS[COMP_CWORD]} at=lk-emu word option= position=0 i
  local words options valued from choices
  COMPREPLY=()
  _lk_emu_at "$at"
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if [[ -n $option ]]; then
      [[ $word == = ]] || option=
    elif [[ $word == -* ]]; then
      [[ " $valued " != *" $word "* ]] || option=$word
    elif [[ " $words " == *" $word "* ]]; then
      at+=" $word"
      _lk_emu_at "$at"
    else
      ((++position))
    fi
    # Words of the program itself come first or not at all.
    [[ $at != lk-emu ]] || words=
  done
  if [[ -n $option ]]; then
    [[ $cur != = ]] || cur=
    _lk_emu_values "$at $option"
    _lk_emu_offer "$cur"
  elif [[ $cur == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
  elif [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$cur")
  else
    _lk_emu_values "$at $position"
    _lk_emu_offer "$cur"
  fi
}

complete -F _lk_emu lk-emu lk-emu-body
)";

struct Tables {
  std::string places;
  std::string values;
};

void add_values(Tables& tables, const std::string& pattern, const std::string& value) {
  const Choices choices = choices_of(value);
  if (choices.none()) return;
  std::string text;
  if (choices.files) text += ",files";
  if (choices.directories) text += ",directories";
  if (choices.interfaces) text += ",interfaces";
  if (choices.list) text += ",list";
  tables.values += fmt::format("  {}) from={} choices={} ;;\n", pattern, shell_quoted(text),
                               shell_quoted(spaced(choices.words)));
}

void add_word(Tables& tables, const Word& word, const Word* parent) {
  std::vector<std::string> options;
  std::vector<std::string> valued;
  std::vector<std::string> words;
  for (const Argument& option : all_options(word, parent)) {
    for (const std::string& name : option.names) {
      options.push_back(name);
      if (option.value.empty()) continue;
      valued.push_back(name);
      add_values(tables, shell_quoted(word.path + " " + name), option.value);
    }
  }
  for (std::size_t n = 0; n < word.positionals.size(); ++n) {
    const Argument& positional = word.positionals[n];
    add_values(tables,
               positional.many ? shell_quoted(word.path + " ") + "[0-9]*"
                               : shell_quoted(word.path + " " + std::to_string(n)),
               positional.value);
  }
  for (const Word& below : word.words) words.push_back(own_name(below));
  tables.places += fmt::format("  {}) words={} options={} valued={} ;;\n", shell_quoted(word.path),
                               shell_quoted(spaced(words)), shell_quoted(spaced(options)),
                               shell_quoted(spaced(valued)));
  for (const Word& below : word.words) add_word(tables, below, &word);
}

}  // namespace

std::string bash_completion(const Word& program) {
  Tables tables;
  add_word(tables, program, nullptr);
  return std::string(kBashHead) + "\n_lk_emu_at() {\n  case $1 in\n" + tables.places +
         "  esac\n}\n\n_lk_emu_values() {\n  from='' choices=''\n  case $1 in\n" + tables.values +
         "  esac\n}\n" + kBody;
}

}  // namespace lk::manual

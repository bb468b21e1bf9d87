#include <fmt/format.h>

#include "tools/manual/completions.hpp"
#include "tools/manual/values.hpp"

namespace lk::manual {
namespace {

constexpr const char* kFishHead =
    R"(# fish completion for lk-emu, made from what its --help is made from.

function __lk_emu_interfaces
    for file in /sys/class/net/*/type
        if test (cat $file) = 280
            basename (dirname $file)
        end
    end
end

# Whether the words so far, without options and their values, are these.
function __lk_emu_at
    set -l path lk-emu
    set -l skip no
    set -l positions 0
    for token in (commandline -opc)[2..-1]
        if test $skip = yes
            set skip no
        else if string match -q -- '-*' $token
            contains -- $token $__lk_emu_valued; and set skip yes
        else if contains -- "$path $token" $__lk_emu_paths
            set path "$path $token"
        else
            set positions (math $positions + 1)
        end
    end
    test "$path" = "$argv[1]"; or return 1
    test (count $argv) -lt 2; or test $positions -eq $argv[2]
end

complete -c lk-emu -f
)";

struct Script {
  std::vector<std::string> valued, paths;
  std::string rules;
};

/// The end of a rule: what to offer.
std::string offer(const std::string& value) {
  const Choices choices = choices_of(value);
  std::string text = choices.files ? " -F" : "";
  const std::string words = spaced(choices.words);
  if (choices.directories) text += " -a '(__fish_complete_directories)'";
  if (choices.interfaces) text += " -a '(__lk_emu_interfaces)'";
  if (choices.list) {
    text += fmt::format(" -a '(__fish_append , {})'", words);
  } else if (!words.empty()) {
    text += fmt::format(" -a '{}'", words);
  }
  return text;
}

std::string rule(const std::string& condition) {
  return fmt::format("complete -c lk-emu -n '__lk_emu_at {}'", condition);
}

void add_word(Script& script, const Word& word, const Word* parent) {
  const std::string here = "\"" + word.path + "\"";
  script.paths.push_back(shell_quoted(word.path));
  for (const Argument& option : all_options(word, parent)) {
    std::string names;
    for (const std::string& name : option.names) {
      const bool is_long = name.starts_with("--");
      names += fmt::format(" -{} {}", is_long ? 'l' : 's', name.substr(is_long ? 2 : 1));
      if (!option.value.empty()) script.valued.push_back(name);
    }
    const std::string value = option.value.empty() ? "" : fmt::format(" -r{}", offer(option.value));
    script.rules +=
        fmt::format("{}{} -d {}{}\n", rule(here), names, shell_quoted(option.about), value);
  }
  for (const Word& below : word.words) {
    script.rules += fmt::format("{} -a {} -d {}\n", rule(here + " 0"), own_name(below),
                                shell_quoted(below.about));
  }
  for (std::size_t n = 0; n < word.positionals.size(); ++n) {
    const Argument& positional = word.positionals[n];
    const std::string offered = offer(positional.value);
    if (offered.empty()) continue;
    const std::string place = positional.many ? "" : fmt::format(" {}", n);
    script.rules += fmt::format("{}{}\n", rule(here + place), offered);
  }
  for (const Word& below : word.words) add_word(script, below, &word);
}

}  // namespace

std::string fish_completion(const Word& program) {
  Script script;
  add_word(script, program, nullptr);
  return std::string(kFishHead) + "\nset -g __lk_emu_valued " + spaced(script.valued) +
         "\nset -g __lk_emu_paths " + spaced(script.paths) + "\n\n" + script.rules;
}

}  // namespace lk::manual

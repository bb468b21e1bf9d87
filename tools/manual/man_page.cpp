#include "tools/manual/man_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>
#include <string_view>

namespace lk::manual {
namespace {

/// What stands on no option: where the program looks, and what it reads besides.
constexpr const char* kFiles[][2] = {
    {"~/.local/state/lk-emu/BUS/", "ROM of the drives, without --rom"},
    {"$XDG_RUNTIME_DIR/lk-emu/", "control sockets, without --control; else in /tmp/lk-emu-UID"},
    {"/etc/lk-emu/NAME.toml", "configuration of the service lk-emu@NAME"},
    {"/var/lib/lk-emu/NAME/", "ROM of its drives"},
    {"/run/lk-emu/NAME/control.sock", "its control socket"},
    {"share/lk-emu/", "beside the program's directory: motors, buses and scenarios it came with"},
};
constexpr const char* kEnvironment[][2] = {
    {"XDG_STATE_HOME, HOME", "where ROM is kept without --rom"},
    {"XDG_RUNTIME_DIR", "where control sockets are"},
    {"NO_COLOR", "unless empty, lk-emu run and lk-emu decode print no colours"},
    {"LC_ALL, LC_MESSAGES, LANG",
     "language of advice, of lk-emu decode and of pictures, without --lang"},
    {"CREDENTIALS_DIRECTORY", "where a service manager keeps the --http-token of a service"},
    {"NOTIFY_SOCKET", "socket of a service manager, which is told of the start and the end"},
};

constexpr const char* kExitStatus = "Exit status:";

/// Text as roff takes it.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool at_line = out.empty() || out.back() == '\n';
    if (at_line && (c == '.' || c == '\'')) out += "\\&";
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '`':
        out += "\\(ga";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      default:
        out += c;
    }
  }
  constexpr std::string_view kEllipsis = "…";
  for (auto at = out.find(kEllipsis); at != std::string::npos; at = out.find(kEllipsis)) {
    out.replace(at, kEllipsis.size(), "...");
  }
  return out;
}

std::string bold(const std::string& text) { return fmt::format("\\fB{}\\fR", roff(text)); }

/// Names are for the reader to replace, small letters to be typed, as is the bar, which comes
/// behind them in ASCII: "DIR|stop".
std::string value_text(const std::string& value) {
  const bool literal = std::ranges::all_of(value, [](char c) { return c >= 'a'; });
  return literal ? bold(value) : fmt::format("\\fI{}\\fR", roff(value));
}

std::string with_many(const Argument& argument) {
  return value_text(argument.value) + (argument.many ? "\\ ..." : "");
}

std::string entry(const std::string& what, const std::string& about) {
  return fmt::format(".TP\n{}\n{}\n", what, roff(about));
}

std::string option_entry(const Argument& option) {
  std::string names;
  for (const std::string& name : option.names) {
    if (!names.empty()) names += ", ";
    names += bold(name);
  }
  if (!option.value.empty()) names += fmt::format(" {}", with_many(option));
  return entry(names, option.about);
}

std::string synopsis(const Word& word) {
  std::string line = bold(word.path) + " [\\fIOPTIONS\\fR]";
  if (!word.words.empty() && word.path != "lk-emu") line += " \\fIWORD\\fR";
  for (const Argument& positional : word.positionals) {
    line += fmt::format(fmt::runtime(positional.required ? " {}" : " [{}]"), with_many(positional));
  }
  return line;
}

std::string arguments(const Word& word) {
  std::string text;
  for (const Argument& positional : word.positionals) {
    text += entry(with_many(positional), positional.about);
  }
  for (const Argument& option : word.options) text += option_entry(option);
  return text;
}

bool is_exit_status(const std::string& note) { return note.starts_with(kExitStatus); }
bool is_example(const std::string& note) { return note.find("\n  ") != std::string::npos; }

void for_each_word(const Word& word, const std::function<void(const Word&)>& visit) {
  visit(word);
  for (const Word& below : word.words) for_each_word(below, visit);
}

std::string commands_section(const Word& program) {
  std::string text;
  for (const Word& word : program.words) {
    text += fmt::format(".SS {}\n{}\n.P\n{}.\n{}", roff(word.path), synopsis(word),
                        roff(word.about), arguments(word));
    for (const Word& below : word.words) {
      text += fmt::format(".TP\n{}\n{}\n.RS\n{}.RE\n", synopsis(below), roff(below.about),
                          arguments(below));
    }
  }
  return text;
}

std::string exit_status_section(const Word& program) {
  std::string text;
  for_each_word(program, [&text](const Word& word) {
    for (const std::string& note : word.notes) {
      if (!is_exit_status(note)) continue;
      const std::size_t begin = note.find_first_not_of(' ', std::string(kExitStatus).size());
      text += fmt::format(".TP\n{}\n{}", bold(word.path), roff(note.substr(begin)));
    }
  });
  return text;
}

/// Indented lines as they are, the others as text.
std::string example(const std::string& note) {
  std::string text;
  bool verbatim = false;
  for (std::size_t begin = 0; begin < note.size();) {
    const std::size_t end = note.find('\n', begin);
    const std::string line = note.substr(begin, end - begin);
    begin = end + 1;
    if (line.starts_with("  ") != verbatim) text += verbatim ? ".EE\n.RE\n" : ".RS\n.EX\n";
    verbatim = line.starts_with("  ");
    text += roff(verbatim ? line.substr(2) : line) + "\n";
  }
  return text + (verbatim ? ".EE\n.RE\n" : "");
}

std::string examples_section(const Word& program) {
  std::string text;
  for_each_word(program, [&text](const Word& word) {
    for (const std::string& note : word.notes) {
      if (is_exit_status(note) || !is_example(note)) continue;
      if (!text.empty()) text += ".P\n";
      text += example(note);
    }
  });
  return text;
}

std::string table(std::span<const char* const[2]> rows) {
  std::string text;
  for (const auto& row : rows) text += entry(bold(row[0]), row[1]);
  return text;
}

}  // namespace

std::string man_page(const Word& program, const std::string& date) {
  std::string text =
      fmt::format(".TH LK\\-EMU 1 {} \"lk\\-emu {}\" \"User Commands\"\n", date, LKEMU_VERSION);
  text += ".SH NAME\nlk\\-emu \\- virtual LK\\-TECH servo drives on a real CAN bus\n.SH SYNOPSIS\n";
  text += synopsis(program) + "\n";
  for (const Word& word : program.words) text += fmt::format(".br\n{}\n", synopsis(word));
  text +=
      ".SH DESCRIPTION\nAnswers on a SocketCAN interface as servo drives of LK\\-TECH do, with a "
      "modelled motor behind each.\nPrints\n.B lk\\-emu ready\nand its buses on standard output "
      "once it can answer, logs to standard error, and ends with SIGINT or SIGTERM.\n";
  text += fmt::format(".SH OPTIONS\n{}", arguments(program));
  text += fmt::format(".SH COMMANDS\n{}", commands_section(program));
  text += fmt::format(".SH EXIT STATUS\n{}", exit_status_section(program));
  text += fmt::format(".SH FILES\n{}", table(kFiles));
  text += fmt::format(".SH ENVIRONMENT\n{}", table(kEnvironment));
  text += fmt::format(".SH EXAMPLES\n{}", examples_section(program));
  text +=
      ".SH SEE ALSO\n.BR candump (1),\n.BR cansend (1),\n.BR ip (8),\n.BR systemd.service (5)\n.P\n"
      "The manual is in the directory docs below share/doc/lk\\-emu.\n";
  return text;
}

}  // namespace lk::manual

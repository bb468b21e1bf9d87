#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>

#include "emulator/config/config.hpp"
#include "emulator/config/config_error.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/monitor/record/recording.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/commands.hpp"
#include "tools/decode/decoder.hpp"
#include "tools/guess/guesser.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kDecodeFooter = R"(
Example, live and of a file:
  candump -t z can0 | lk-emu decode --generation v236 --motor mg4005
  lk-emu decode candump-2026-11-21_233328.log --json
  lk-emu decode --guess candump-2026-11-21_233328.log

Exit status: 0 the log has ended, or SIGINT or SIGTERM came, 1 failed while running, 2 unusable
input.)";

struct RawDecode {
  std::string file;
  std::string generation;
  std::string motor;
  bool guess = false;
  bool json = false;
  std::string language;
};

void add_options(CLI::App& app, RawDecode& raw) {
  app.add_option("FILE", raw.file,
                 "output or log of candump (default, and -: standard input), or the directory of a "
                 "recording, which describes its drives");
  app.add_option("--generation", raw.generation,
                 "firmware of the drives, one of " + comma_list(generation_words()) +
                     " (default legacy); seen: as measured on real drives of the motor")
      ->type_name("GENERATION");
  app.add_option("--motor", raw.motor,
                 std::string("motor of the drives, a name or a file, for the scales (default ") +
                     kDefaultMotor + ")")
      ->type_name("MOTOR");
  app.add_flag("--guess", raw.guess,
               "print at the end which generation and quirks the drives have, and the frames that "
               "show it")
      ->excludes("--generation")
      ->excludes("--motor");
  app.add_flag("--json", raw.json,
               "one JSON object per line, for programs; the last is the summary");
  add_language_option(app, raw.language);
}

volatile std::sig_atomic_t g_asked_to_stop = 0;

extern "C" void stop_decoding(int /*signal*/) { g_asked_to_stop = 1; }

/// Makes SIGINT and SIGTERM end the reading. Both signals are blocked outside of wait_for().
class StopSignals {
 public:
  StopSignals() {
    sigset_t stops;
    sigemptyset(&stops);
    for (const int signal : {SIGINT, SIGTERM}) {
      struct sigaction before {};
      ::sigaction(signal, nullptr, &before);
      if (before.sa_handler == SIG_IGN) continue;  // the parent process has disabled the signal
      struct sigaction action {};
      action.sa_handler = stop_decoding;
      ::sigaction(signal, &action, nullptr);
      sigaddset(&stops, signal);
    }
    ::sigprocmask(SIG_BLOCK, &stops, &otherwise_);
  }

  /// Waits until `fd` has input. Returns false if a signal has arrived, so that reading must stop.
  bool wait_for(int fd) const {
    // Checks pending signals first, because ppoll() delivers none while input is always ready.
    sigset_t arrived;
    sigpending(&arrived);
    if (sigismember(&arrived, SIGINT) == 1 || sigismember(&arrived, SIGTERM) == 1) return false;
    pollfd input{fd, POLLIN, 0};
    while (g_asked_to_stop == 0) {
      if (::ppoll(&input, 1, nullptr, &otherwise_) > 0) return true;
      if (errno != EINTR) return true;  // read() reports the error
    }
    return false;
  }

 private:
  sigset_t otherwise_{};
};

bool wants_colour() {
  const auto env = [](const char* name) {
    const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before threads
    return std::string(value != nullptr ? value : "");
  };
  return ::isatty(STDOUT_FILENO) != 0 && env("NO_COLOR").empty() && env("TERM") != "dumb";
}

DecodeOptions read_options(const CLI::App& app, const RawDecode& given) {
  DecodeOptions options;
  options.generation_given = app.count("--generation") > 0;
  options.motor_given = app.count("--motor") > 0;
  options.language = chosen_language(given.language);
  options.json = given.json;
  options.colour = !given.json && wants_colour();
  try {
    options.profile = load_profile(options.motor_given ? given.motor : kDefaultMotor);
  } catch (const UnknownMotor& problem) {
    throw StartError(std::string("--motor: ") + problem.what());
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
  if (!options.generation_given) return options;
  try {
    options.generation = chosen_generation(given.generation, options.profile);
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--generation: ") + problem.what());
  }
  return options;
}

std::string because() { return std::strerror(errno); }  // NOLINT(concurrency-mt-unsafe): one thread

/// Splits chunks of input into lines, and returns the output of the reader for these lines.
template <class Reader>
class Lines {
 public:
  explicit Lines(Reader& reader) : reader_(reader) {}

  std::string take(std::string_view chunk) {
    std::string out;
    while (!chunk.empty()) {
      const std::size_t length = std::min(chunk.find('\n'), chunk.size());
      // Stores only the beginning of a line that is too long.
      const std::size_t room = kLongestCandumpLine + 2 - begun_.size();
      begun_ += chunk.substr(0, std::min(length, room));
      if (length == chunk.size()) break;
      out += reader_.take(begun_);
      begun_.clear();
      chunk.remove_prefix(length + 1);
    }
    return out;
  }
  std::string finish() {
    std::string out = begun_.empty() ? "" : reader_.take(begun_);
    return out + reader_.finish();
  }

 private:
  Reader& reader_;
  std::string begun_;
};

/// Prints the text. Returns false if the process that reads standard output has closed it.
bool print(const std::string& text) {
  const int error = text.empty() ? 0 : write_all(STDOUT_FILENO, text);
  if (error == 0 || error == EPIPE) return error == 0;
  errno = error;
  throw std::runtime_error("standard output: " + because());
}

/// Decodes the input of `fd`. Prints the output for each chunk before it reads more. Returns true
/// at the end of the input, false if it had to stop before.
template <class Reader>
bool decode(int fd, const std::string& name, Reader& reader) {
  Lines lines(reader);
  const StopSignals signals;
  std::string chunk(std::size_t{64} * 1024, '\0');
  bool ended = false;
  while (signals.wait_for(fd)) {
    const ssize_t length = ::read(fd, chunk.data(), chunk.size());
    if (length < 0 && errno == EINTR) continue;
    if (length < 0) throw StartError("decode: cannot read " + name + ": " + because());
    ended = length == 0;
    if (ended) break;
    if (!print(lines.take({chunk.data(), static_cast<std::size_t>(length)}))) return false;
  }
  print(lines.finish());
  return ended;
}

/// Returns the word for --motor of the shipped motor with this label; empty if none has it. This is
/// the motor's name, or the label if it says more.
std::string motor_sold_as(const std::string& label) {
  // The label may come from a log, and must not be used as a path.
  const bool is_label = !label.empty() && std::ranges::all_of(label, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-';
  });
  if (!is_label) return "";
  try {
    const LabelFacts facts = label_facts(label);
    const std::string name = find_motor_file(label).name;
    return facts.encoder_span || facts.later_print ? small_letters(label) : name;
  } catch (const UnknownMotor&) {
    return "";
  }
}

/// Reads the whole log. Throws StartError if it contains no frame.
template <class Reader>
void read_log(const std::string& log, Reader& reader) {
  const bool from_input = log.empty() || log == "-";
  const std::string name = from_input ? "standard input" : sanitized_line(log);
  Descriptor file;
  if (!from_input) {
    file = Descriptor(::open(log.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file) throw StartError("decode: cannot read " + name + ": " + because());
  } else if (::isatty(STDIN_FILENO) != 0) {
    std::fputs(
        "lk-emu decode: reading the terminal; to read a bus: candump -t z can0 | lk-emu decode\n",
        stderr);
  }
  const bool ended = decode(from_input ? STDIN_FILENO : file.get(), name, reader);
  if (reader.frames() > 0) return;
  if (reader.bad_lines() > 0) {
    throw StartError("decode: no candump frame in " + name + "; " + reader.first_problem());
  }
  if (ended) throw StartError("decode: " + name + " has no frame: give it a log of candump");
}

int explain(const CLI::App& app, const RawDecode& given) {
  std::error_code unreadable;
  const bool recorded = std::filesystem::is_directory(given.file, unreadable);
  const std::string log =
      recorded ? (std::filesystem::path(given.file) / kFramesFile).string() : given.file;
  if (given.guess) {
    Guesser guesser({.json = given.json,
                     .language = chosen_language(given.language),
                     .motor_of = motor_sold_as});
    read_log(log, guesser);
    return 0;
  }
  DecodeOptions options = read_options(app, given);
  if (recorded) {
    refuse_options(app, {"--generation", "--motor"},
                   "decode: {} is for logs; a recording contains its own");
    options.buses = read_recording(given.file).buses;
  }
  Decoder decoder(std::move(options));
  read_log(log, decoder);
  return 0;
}

}  // namespace

RunCommand declare_decode(CLI::App& app, Arguments /*arguments*/) {
  const auto raw = std::make_shared<RawDecode>();
  app.footer(kDecodeFooter);
  add_options(app, *raw);
  return [raw, &app] { return explain(app, *raw); };
}

}  // namespace lk::emulator

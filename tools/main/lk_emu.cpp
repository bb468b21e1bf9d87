#include <fcntl.h>
#include <poll.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string_view>
#include <utility>

#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/io/program/config_listing.hpp"
#include "emulator/monitor/scenario/scenario_runner.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/main/bodies.hpp"

namespace {

void start_logging(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("lk-emu"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_level(spdlog::level::from_str(level));
}

int run(int argc, char** argv) {
  lk::emulator::provide_bodies();
  if (argc > 1) {
    const lk::emulator::Arguments arguments(argv + 1, static_cast<std::size_t>(argc) - 1);
    if (const auto* command = lk::emulator::find_command(arguments.front())) {
      return lk::emulator::run_command(*command, arguments);
    }
    if (arguments.front() == std::string_view("__complete")) {
      return lk::emulator::run_complete(arguments);
    }
  }
  auto command_line = lk::emulator::parse_command_line(argc, argv);
  if (!command_line) return 0;
  start_logging(command_line->log_level);
  auto buses = lk::emulator::load_config(*command_line);
  lk::emulator::RunOptions& options = command_line->run;
  if (command_line->scenario) {
    options.scenario = lk::emulator::load_live_scenario(*command_line->scenario, buses);
  }
  if (command_line->check) {
    lk::emulator::load_rom_read_only(options.rom, buses);
    std::fputs(lk::emulator::describe_run(buses).c_str(), stdout);
    return 0;
  }
  lk::emulator::Daemon daemon(std::move(buses), options);
  return daemon.run();
}

/// Runs the program. Prints one line for an error. Returns the exit status.
int run_and_report_errors(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const lk::emulator::StartError& problem) {
    std::fprintf(stderr, "lk-emu: %s\n", lk::emulator::sanitized_line(problem.what()).c_str());
    return 2;
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "lk-emu: failed: %s\n",
                 lk::emulator::sanitized_line(problem.what()).c_str());
    return 1;
  }
}

/// Opens /dev/null for each closed standard descriptor, so that no other file gets its number.
void fill_standard_descriptors() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(number, F_GETFD) < 0) ::open("/dev/null", O_RDWR);
  }
}

/// Flushes standard output. Returns true if all is written, or if its reader has closed it.
bool output_is_written() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  // If an earlier write failed, errno no longer has its reason.
  const char* const reason = errno != 0 ? std::strerror(errno) : "not all of it could be written";
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  ::poll(&output, 1, 0);
  if ((output.revents & (POLLERR | POLLHUP)) != 0) return true;
  std::fprintf(stderr, "lk-emu: standard output: %s\n", reason);
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  fill_standard_descriptors();
  std::signal(SIGPIPE, SIG_IGN);  // the reader of our output may exit first
  std::signal(SIGXFSZ, SIG_IGN);  // beyond a file size limit, writes fail instead
  const int status = run_and_report_errors(argc, argv);
  if (output_is_written()) return status;
  return status != 0 ? status : 1;
}

#include "tests/host/emulator_process.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace lk::host {
namespace {

using Clock = std::chrono::steady_clock;

/// Prefix of the program in every test, such as "valgrind --quiet", from $LKEMU_LAUNCHER. A test's
/// own prefix (env, setpriv, …) comes first, since valgrind does not follow it.
std::vector<std::string> launcher_of_all() {
  const char* const said = std::getenv("LKEMU_LAUNCHER");
  std::istringstream text(said != nullptr ? said : "");
  return {std::istream_iterator<std::string>(text), {}};
}

/// Appends the available data of `fd`; closes it at its end.
void drain(int& fd, std::string& text) {
  std::array<char, 4096> buffer;
  const ssize_t size = ::read(fd, buffer.data(), buffer.size());
  if (size > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(size));
  } else {
    ::close(fd);
    fd = -1;
  }
}

pid_t spawn(std::vector<std::string> words, int out, int err) {
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  pid_t pid = -1;
  const int error = ::posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot start " + words[0]);
  return pid;
}

}  // namespace

EmulatorProcess::EmulatorProcess(const std::vector<std::string>& arguments,
                                 const std::vector<std::string>& launcher) {
  std::array<int, 2> out{};
  std::array<int, 2> err{};
  if (::pipe2(out.data(), O_CLOEXEC) < 0 || ::pipe2(err.data(), O_CLOEXEC) < 0) {
    throw std::runtime_error("pipe");
  }
  std::vector<std::string> words = launcher;
  for (const std::string& word : launcher_of_all()) words.push_back(word);
  words.emplace_back(LKEMU_PROGRAM);
  words.insert(words.end(), arguments.begin(), arguments.end());
  pid_ = spawn(words, out[1], err[1]);
  ::close(out[1]);
  ::close(err[1]);
  out_fd_ = out[0];
  err_fd_ = err[0];
}

EmulatorProcess::~EmulatorProcess() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  if (out_fd_ >= 0) ::close(out_fd_);
  if (err_fd_ >= 0) ::close(err_fd_);
}

bool EmulatorProcess::pump_until(const std::function<bool()>& done) {
  const auto deadline = Clock::now() + std::chrono::milliseconds(kPatience_ms);
  while (!done()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0 || (out_fd_ < 0 && err_fd_ < 0)) return false;
    std::array<pollfd, 2> fds = {{{out_fd_, POLLIN, 0}, {err_fd_, POLLIN, 0}}};
    ::poll(fds.data(), fds.size(), static_cast<int>(left.count()));
    if (fds[0].revents != 0) drain(out_fd_, exit_.out);
    if (fds[1].revents != 0) drain(err_fd_, exit_.err);
  }
  return true;
}

bool EmulatorProcess::wait_ready() {
  return pump_until([this] {
    const auto start = exit_.out.find("lk-emu ready");
    return start != std::string::npos && exit_.out.find('\n', start) != std::string::npos;
  });
}

bool EmulatorProcess::wait_for_log(const std::string& text, int times) {
  return pump_until([&] { return count_of(exit_.err, text) >= times; });
}

void EmulatorProcess::signal(int number) const { ::kill(pid_, number); }

EmulatorProcess::Exit EmulatorProcess::wait() {
  const bool ended = pump_until([this] { return out_fd_ < 0 && err_fd_ < 0; });
  if (!ended) ::kill(pid_, SIGKILL);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  if (ended) exit_.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return exit_;
}

EmulatorProcess::Exit EmulatorProcess::stop(int number) {
  signal(number);
  return wait();
}

StartedEmulator::StartedEmulator(const std::vector<std::string>& arguments,
                                 const std::vector<std::string>& launcher)
    : EmulatorProcess(arguments, launcher) {
  if (!wait_ready()) throw std::runtime_error("lk-emu is not ready: " + wait().err);
}

void expect_refused(EmulatorProcess&& emulator, const std::string& error) {
  const EmulatorProcess::Exit result = emulator.wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err, error);
  EXPECT_EQ(result.out, "");
}

std::vector<std::string> as_another_user() {
  return {"setpriv",
          "--reuid=65534",
          "--regid=65534",
          "--clear-groups",
          "--inh-caps=-all,+dac_read_search",
          "--ambient-caps=-all,+dac_read_search"};
}

std::map<std::string, std::string> process_status(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  std::map<std::string, std::string> status;
  for (std::string key, value; std::getline(file, key, ':') && std::getline(file, value);) {
    status[key] = value.substr(value.find_first_not_of('\t'));
  }
  return status;
}

int count_of(const std::string& text, const std::string& what) {
  int count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

bool run(const std::string& command) { return std::system(command.c_str()) == 0; }

}  // namespace lk::host

#include "tools/campaign/hosts/case_keeper.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <utility>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

using Event = CaseKeeper::Event;
using What = CaseKeeper::What;

/// As execve takes it. Made before the process forks: a process that has forked from one with
/// threads has to do without memory of its own.
class Prepared {
 public:
  explicit Prepared(Program program) : program_(std::move(program)) {
    for (std::string& word : program_.arguments) arguments_.push_back(word.data());
    for (std::string& word : program_.environment) environment_.push_back(word.data());
    arguments_.push_back(nullptr);
    environment_.push_back(nullptr);
  }
  Prepared(const Prepared&) = delete;
  Prepared& operator=(const Prepared&) = delete;

  int out() const { return program_.out; }
  int error() const { return program_.error; }
  /// In place of the process that calls it. Returns when that cannot be; errno says why.
  void execute() const {
    if (!program_.directory.empty() && ::chdir(program_.directory.c_str()) != 0) return;
    ::execve(program_.path.c_str(), arguments_.data(), environment_.data());
  }

 private:
  Program program_;
  std::vector<char*> arguments_, environment_;
};

/// "0 1000 1\n": in there it is root, out here it is who it was.
struct IdMaps {
  std::string user = "0 " + std::to_string(::geteuid()) + " 1\n";
  std::string group = "0 " + std::to_string(::getegid()) + " 1\n";
};

bool write_text(const char* path, const char* text) {
  const int fd = ::open(path, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const auto size = static_cast<ssize_t>(std::strlen(text));
  const bool written = ::write(fd, text, static_cast<std::size_t>(size)) == size;
  ::close(fd);
  return written;
}

bool enter_own_network(const IdMaps& maps) {
  if (::unshare(CLONE_NEWNET) == 0) return true;
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  return write_text("/proc/self/setgroups", "deny") &&
         write_text("/proc/self/uid_map", maps.user.c_str()) &&
         write_text("/proc/self/gid_map", maps.group.c_str());
}

/// All but the standard ones and these.
void close_all_but(std::array<int, 5> kept) {
  std::ranges::sort(kept);
  unsigned first = 3;
  const auto close_up_to = [&](unsigned last) {
    if (first > last || ::syscall(SYS_close_range, first, last, 0) == 0) return;
    const auto most = static_cast<unsigned>(::sysconf(_SC_OPEN_MAX));  // Linux before 5.9
    for (unsigned fd = first; fd <= std::min(last, most); ++fd) ::close(static_cast<int>(fd));
  };
  for (const int fd : kept) {
    if (fd < static_cast<int>(first)) continue;
    close_up_to(static_cast<unsigned>(fd) - 1);
    first = static_cast<unsigned>(fd) + 1;
  }
  close_up_to(~0U);
}

/// What the process `text`, the beginning of its /proc/PID/stat, is a child of: "7 (any) S 1 …".
pid_t parent_in(const char* text) {
  const char* const name_end = std::strrchr(text, ')');
  if (name_end == nullptr || std::strlen(name_end) < 5) return -1;
  pid_t parent = 0;
  for (const char* at = name_end + 4; *at >= '0' && *at <= '9'; ++at) {
    parent = parent * 10 + (*at - '0');
  }
  return parent;
}

pid_t parent_of(const char* pid) {
  std::array<char, 64> path{"/proc/"};
  if (std::strlen(pid) > 16) return -1;
  std::strcat(path.data(), pid);
  std::strcat(path.data(), "/stat");
  const int fd = ::open(path.data(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return -1;
  std::array<char, 256> text{};
  const ssize_t size = ::read(fd, text.data(), text.size() - 1);
  ::close(fd);
  return size > 0 ? parent_in(text.data()) : -1;
}

struct Entry {  // of getdents64
  std::uint64_t inode;
  std::int64_t offset;
  std::uint16_t size;
  std::uint8_t type;
  char name[1];
};

/// Calls `act` with the open directory and the name of each of its entries.
template <class Act>
void for_each_entry(const char* directory, Act act) {
  const int fd = ::open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  alignas(Entry) std::array<char, 8192> entries;
  for (;;) {
    const long size = ::syscall(SYS_getdents64, fd, entries.data(), entries.size());
    if (size <= 0) break;
    for (long at = 0; at < size;) {
      const auto* entry = reinterpret_cast<const Entry*>(entries.data() + at);
      at += entry->size;
      act(fd, entry->name);
    }
  }
  ::close(fd);
}

/// There are no directories in it.
void remove_directory(const char* directory) {
  for_each_entry(directory, [](int fd, const char* name) { ::unlinkat(fd, name, 0); });
  ::rmdir(directory);
}

/// The process that a case's processes are children of, or become when their parents end.
class Keeper {
 public:
  Keeper(const Prepared& emulator, const Prepared& host, const char* directory, int control)
      : emulator_(emulator), host_(host), directory_(directory), control_(control) {}

  [[noreturn]] void run(const IdMaps* own_network) {
    ::setsid();  // Ctrl-C is for the campaign, which then ends us
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGCHLD}) ::signal(number, SIG_DFL);
    ::sigemptyset(&nothing_);
    sigset_t children = nothing_;
    ::sigaddset(&children, SIGCHLD);
    ::sigprocmask(SIG_SETMASK, &children, nullptr);
    close_all_but({control_, emulator_.out(), emulator_.error(), host_.out(), host_.error()});
    const int signals = ::signalfd(-1, &children, SFD_CLOEXEC | SFD_NONBLOCK);
    if (own_network != nullptr && !enter_own_network(*own_network)) say(What::kNoNetwork, errno);
    while (serve(signals)) {
    }
    end_all_but(0);
    remove_directory(directory_);
    ::_exit(0);
  }

 private:
  /// Returns false when there is nobody any more to keep them for.
  bool serve(int signals) {
    std::array<pollfd, 2> ready{{{control_, POLLIN, 0}, {signals, POLLIN, 0}}};
    if (::poll(ready.data(), ready.size(), -1) < 0) return errno == EINTR;
    if (ready[1].revents != 0) {
      signalfd_siginfo ignored;
      while (::read(signals, &ignored, sizeof ignored) > 0) {
      }
      while (reap(WNOHANG)) {
      }
    }
    if (ready[0].revents == 0) return true;
    char order = 0;
    if (::recv(control_, &order, 1, 0) != 1) return false;
    if (order == 'e') emulator_pid_ = start(emulator_, What::kEmulatorAbsent);
    if (order == 'h') {
      host_pid_ = start(host_, What::kHostAbsent);
      // So that the end of its output is seen.
      ::close(host_.out());
      if (host_.error() != host_.out()) ::close(host_.error());
    }
    if (order == 'o') {
      end_all_but(emulator_pid_);
      say(What::kOthersEnded, 0);
    }
    return true;
  }

  pid_t start(const Prepared& program, What absent) {
    const pid_t keeper = ::getpid();
    const pid_t pid = ::fork();
    if (pid < 0) say(absent, errno);
    if (pid != 0) return pid;
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != keeper) ::_exit(1);
    for (const int number : {SIGPIPE, SIGXFSZ}) ::signal(number, SIG_DFL);
    ::sigprocmask(SIG_SETMASK, &nothing_, nullptr);
    const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(program.out(), STDOUT_FILENO);
    ::dup2(program.error(), STDERR_FILENO);
    program.execute();
    say(absent, errno);
    ::_exit(127);
  }

  /// Kills all children but `spared`; those that have ended count too. Returns how many.
  static int kill_all_but(pid_t spared) {
    const pid_t self = ::getpid();
    int killed = 0;
    for_each_entry("/proc", [&](int /*proc*/, const char* name) {
      if (name[0] < '1' || name[0] > '9' || parent_of(name) != self) return;
      pid_t pid = 0;
      for (const char* digit = name; *digit != 0; ++digit) pid = pid * 10 + (*digit - '0');
      if (pid == spared) return;
      ::kill(pid, SIGKILL);
      ++killed;
    });
    return killed;
  }

  /// Children of those that end become ours.
  void end_all_but(pid_t spared) {
    while (kill_all_but(spared) > 0) {
      reap(0);
      while (reap(WNOHANG)) {
      }
    }
  }

  bool reap(int options) {
    int status = 0;
    const pid_t pid = ::waitpid(-1, &status, options);
    if (pid <= 0) return false;
    if (pid == emulator_pid_) say(What::kEmulatorEnded, status);
    if (pid == host_pid_) say(What::kHostEnded, status);
    return true;
  }

  void say(What what, int value) const {
    const Event event{what, value};
    ::send(control_, &event, sizeof event, MSG_NOSIGNAL);
  }

  const Prepared& emulator_;
  const Prepared& host_;
  const char* directory_;
  int control_;
  sigset_t nothing_{};
  pid_t emulator_pid_ = -1, host_pid_ = -1;
};

}  // namespace

CaseKeeper::CaseKeeper(const Program& emulator, const Program& host, const std::string& directory,
                       bool own_network) {
  const Prepared first(emulator);
  const Prepared second(host);
  const IdMaps maps;
  std::array<int, 2> ends{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw StartError("host: " + reason_of(errno));
  }
  control_ = Descriptor(ends[0]);
  const Descriptor other(ends[1]);
  keeper_ = ::fork();
  if (keeper_ < 0) throw StartError("host: no process is to be had: " + reason_of(errno));
  if (keeper_ == 0)
    Keeper(first, second, directory.c_str(), ends[1]).run(own_network ? &maps : nullptr);
}

CaseKeeper::~CaseKeeper() {
  control_ = Descriptor();
  while (::waitpid(keeper_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void CaseKeeper::tell(Order order) const {
  const char word = order;
  ::send(control_.get(), &word, 1, MSG_NOSIGNAL);
}

std::optional<CaseKeeper::Event> CaseKeeper::take() {
  Event event;
  const ssize_t size = ::recv(control_.get(), &event, sizeof event, MSG_DONTWAIT);
  if (size == static_cast<ssize_t>(sizeof event)) return event;
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
  throw StartError("host: the process that keeps a case's processes was killed");
}

}  // namespace lk::emulator

#include "emulator/io/program/process.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "emulator/core/start_error.hpp"

namespace lk::emulator {

InputWatch::InputWatch(boost::asio::io_context& loop, std::function<void()> on_end)
    : input_(loop), on_end_(std::move(on_end)) {
  struct stat input {};
  // Rejects a terminal: Asio would make it non-blocking, also for the shell that shares it.
  if (::fstat(STDIN_FILENO, &input) != 0 || !(S_ISFIFO(input.st_mode) || S_ISSOCK(input.st_mode))) {
    throw StartError("--end-with-stdin: standard input is not a pipe; start lk-emu with one");
  }
  const int descriptor = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (descriptor < 0) throw StartError("--end-with-stdin: " + errno_text(errno));
  input_.assign(descriptor);
  read_some();
}

void InputWatch::read_some() {
  input_.async_read_some(boost::asio::buffer(ignored_),
                         [this](const boost::system::error_code& error, std::size_t /*size*/) {
                           if (error == boost::asio::error::operation_aborted) return;
                           if (error) return on_end_();
                           read_some();
                         });
}

namespace {

namespace fs = std::filesystem;

/// Returns true if `path` or a parent directory belongs to another user.
bool is_below_another(fs::path path) {
  for (;; path = path.parent_path()) {
    struct stat found {};
    if (::stat(path.c_str(), &found) == 0 && found.st_uid != ::geteuid()) return true;
    if (!path.has_relative_path()) return false;
  }
}

/// Returns true if another user owns the path, its target, or a directory above them. The path may
/// be a link to a terminal: its removal needs rights in its directory, writing needs rights at its
/// target.
bool belongs_to_another(const fs::path& place) {
  const fs::path path = fs::absolute(place);
  std::error_code ignored;
  return is_below_another(fs::weakly_canonical(path.parent_path(), ignored)) ||
         is_below_another(fs::weakly_canonical(path, ignored));
}

[[noreturn]] void fail() {
  throw StartError(std::string("cannot give up capabilities: ") + std::strerror(errno));
}

}  // namespace

void give_up_privileges(const std::vector<fs::path>& places) {
  const bool keeps_files = ::geteuid() == 0 && std::ranges::any_of(places, belongs_to_another);
  const unsigned kept = keeps_files ? 1U << CAP_DAC_OVERRIDE : 0;
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail();
  ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  // A failure is harmless: after PR_SET_NO_NEW_PRIVS, no execve can restore these capabilities.
  for (int capability = 0; ::prctl(PR_CAPBSET_READ, capability, 0, 0, 0) >= 0; ++capability) {
    ::prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);
  }
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> held{};
  if (::syscall(SYS_capget, &header, held.data()) != 0) fail();
  // Does not call capset needlessly: the systemd unit forbids it, and runs without capabilities.
  const auto is_empty = [](const __user_cap_data_struct& set) {
    return (set.effective | set.permitted | set.inheritable) == 0;
  };
  if (std::ranges::all_of(held, is_empty)) return;
  const unsigned left = held[0].permitted & kept;
  held = {};
  held[0].effective = held[0].permitted = left;
  if (::syscall(SYS_capset, &header, held.data()) != 0) fail();
}

void notify_service_manager(const std::string& state) {
  const char* const name = std::getenv("NOTIFY_SOCKET");
  const std::string path = name == nullptr ? "" : name;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() < 2 || path.size() > sizeof address.sun_path) return;
  path.copy(address.sun_path, path.size());
  if (path.front() == '@') address.sun_path[0] = '\0';  // abstract name, without a file
  // A blocking socket: if the manager's queue is full, waits, so that no message is lost.
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return;
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  ::sendto(fd, state.data(), state.size(), MSG_NOSIGNAL,
           reinterpret_cast<const sockaddr*>(&address), length);
  ::close(fd);
}

}  // namespace lk::emulator

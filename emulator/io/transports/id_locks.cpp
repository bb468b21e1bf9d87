#include "emulator/io/transports/id_locks.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <system_error>

#include "emulator/core/start_error.hpp"

namespace lk::emulator {
namespace {

/// Length of a lock's connection queue: so many programs can ask for the holder between two calls
/// of `drain_queue`.
constexpr int kBacklog = 64;

/// Name of a lock in the abstract socket namespace, which has no files.
class Address {
 public:
  Address(const std::string& interface, int id)
      : name_("lk-emu/" + interface + "/" + std::to_string(id)) {
    address_.sun_family = AF_UNIX;
    std::memcpy(address_.sun_path + 1, name_.data(), name_.size());
    size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name_.size());
  }
  const std::string& name() const { return name_; }
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&address_); }
  socklen_t size() const { return size_; }

 private:
  std::string name_;
  sockaddr_un address_{};
  socklen_t size_;
};

Descriptor open_socket() {
  Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket) throw std::system_error(errno, std::generic_category(), "socket");
  return socket;
}

struct Holder {
  pid_t pid = 0;  // 0: unknown, or in another PID namespace
  bool responds = true;
};

/// Asks the kernel for the PID behind the lock; does not block.
Holder holder_of(const Address& address) {
  const Descriptor socket = open_socket();
  if (::connect(socket.get(), address.get(), address.size()) < 0) {
    // EAGAIN: the holder's queue is full, as it has not called `drain_queue` for a while.
    return {.responds = errno != EAGAIN};
  }
  ucred who{};
  socklen_t size = sizeof who;
  if (::getsockopt(socket.get(), SOL_SOCKET, SO_PEERCRED, &who, &size) < 0) return {};
  return {.pid = who.pid};
}

[[noreturn]] void refuse(const std::string& interface, int id, const Address& address,
                         const std::string& remedy) {
  const std::string drive = interface + ": ID " + std::to_string(id);
  const Holder holder = holder_of(address);
  if (!holder.responds) {
    throw StartError(drive + " is held by a program that does not respond; ss -xlp | grep " +
                     address.name() + " shows it: stop it, or " + remedy);
  }
  const pid_t pid = holder.pid;
  if (pid == ::getpid()) {
    throw StartError(drive +
                     " is given twice: another of the buses is the other end of this vxcan pair, "
                     "or the same interface by another name");
  }
  const std::string who = pid != 0 ? "lk-emu (pid " + std::to_string(pid) + ")"
                                   : "another program (perhaps in another container)";
  throw StartError(drive + " is already in use by " + who + "; stop it, or " + remedy);
}

}  // namespace

void IdLocks::take(const std::string& interface, const LinkState& link, int id,
                   const std::string& remedy) {
  // A sorted set. If two programs start at the two ends of a pair, both lock in the same order. One
  // of them gets both locks.
  std::set<std::string> names = {link.name.empty() ? interface : link.name};
  if (link.peer != 0) names.insert(link_name(link.peer));
  names.erase("");  // the peer was removed meanwhile
  for (const std::string& name : names) {
    const Address address(name, id);
    Descriptor socket = open_socket();
    if (::bind(socket.get(), address.get(), address.size()) < 0) {
      if (errno == EADDRINUSE) refuse(interface, id, address, remedy);
      throw std::system_error(errno, std::generic_category(), "bind");
    }
    if (::listen(socket.get(), kBacklog) < 0) {
      throw std::system_error(errno, std::generic_category(), "listen");
    }
    held_.push_back({interface, id, std::move(socket)});
  }
}

void IdLocks::release(const std::string& interface, int id) {
  std::erase_if(held_,
                [&](const Held& held) { return held.interface == interface && held.id == id; });
}

bool IdLocks::holds(const std::string& interface, int id) const {
  return std::ranges::any_of(
      held_, [&](const Held& held) { return held.interface == interface && held.id == id; });
}

void IdLocks::drain_queue() const {
  for (const Held& held : held_) {
    int refused = 0;
    while (refused < kBacklog &&
           Descriptor(::accept4(held.socket.get(), nullptr, nullptr, SOCK_CLOEXEC))) {
      ++refused;
    }
  }
}

}  // namespace lk::emulator

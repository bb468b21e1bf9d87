#include "tools/campaign/hosts/control_relay.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

constexpr int kMostWaiting = 16;
constexpr std::size_t kPiece = 65536;

sockaddr_un address_of(const std::filesystem::path& path) {
  const std::string name = path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() >= sizeof address.sun_path) {
    throw StartError("host: " + name + " is longer than the path of a socket can be");
  }
  std::copy(name.begin(), name.end(), std::begin(address.sun_path));
  return address;
}

/// Returns false when nothing more will come from there, or go there.
bool read_some(int fd, std::string& text) {
  std::array<char, kPiece> buffer;
  const ssize_t size = ::recv(fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (size > 0) text.append(buffer.data(), static_cast<std::size_t>(size));
  return size > 0 || (size < 0 && (errno == EAGAIN || errno == EINTR));
}

bool write_some(int fd, std::string& text) {
  const ssize_t size = ::send(fd, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (size > 0) text.erase(0, static_cast<std::size_t>(size));
  return size >= 0 || errno == EAGAIN || errno == EINTR;
}

}  // namespace

ControlRelay::ControlRelay(const std::filesystem::path& path, std::filesystem::path control,
                           std::function<void()> before_request)
    : control_(std::move(control)),
      before_request_(std::move(before_request)),
      listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  const sockaddr_un address = address_of(path);
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.get(), kMostWaiting) != 0) {
    throw StartError("host: " + path.string() + ": " + reason_of(errno));
  }
}

/// Reads no more than it can pass on.
short ControlRelay::events_of(const Way& in, const Way& out) {
  int events = 0;
  if (!in.ended && in.waiting.empty()) events |= POLLIN;
  if (!out.waiting.empty()) events |= POLLOUT;
  return static_cast<short>(events);
}

void ControlRelay::add_to(std::vector<pollfd>& waits) const {
  waits.push_back({listener_.get(), POLLIN, 0});
  for (const Client& client : clients_) {
    const auto add = [&](int fd, short events) {
      // What has hung up would wake us for ever.
      waits.push_back({events != 0 ? fd : -1, events, 0});
    };
    add(client.host.get(), events_of(client.request, client.answer));
    add(client.emulator.get(), events_of(client.answer, client.request));
  }
}

void ControlRelay::serve(const pollfd* ready) {
  const bool new_ones = (ready++)->revents != 0;
  for (auto client = clients_.begin(); client != clients_.end(); ready += 2) {
    client = serve(*client, ready[0].revents, ready[1].revents) ? std::next(client)
                                                                : clients_.erase(client);
  }
  if (new_ones) let_in();
}

void ControlRelay::let_in() {
  for (;;) {
    Descriptor host(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!host) return;
    Descriptor emulator(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const sockaddr_un address = address_of(control_);
    if (::connect(emulator.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
        0) {
      continue;
    }
    clients_.push_back({std::move(host), std::move(emulator), {}, {}});
  }
}

/// Returns false when it has been served.
bool ControlRelay::serve(Client& client, short host, short emulator) const {
  const auto read = [](Way& way, int from, bool readable) {
    if (readable && way.waiting.empty() && !read_some(from, way.waiting)) way.ended = true;
  };
  read(client.request, client.host.get(), (host & ~POLLOUT) != 0);
  read(client.answer, client.emulator.get(), (emulator & ~POLLOUT) != 0);
  if (!client.request.waiting.empty()) {
    before_request_();
    if (!write_some(client.emulator.get(), client.request.waiting)) return false;
  }
  if (!client.answer.waiting.empty() && !write_some(client.host.get(), client.answer.waiting)) {
    return false;
  }
  if (client.answer.ended && client.answer.waiting.empty()) return false;
  if (client.request.ended && client.request.waiting.empty() && !client.request.told) {
    ::shutdown(client.emulator.get(), SHUT_WR);
    client.request.told = true;
  }
  return true;
}

}  // namespace lk::emulator

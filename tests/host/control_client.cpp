#include "tests/host/control_client.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace lk::host {

double Answer::number(const std::string& key) const {
  const auto at = body.find("\"" + key + "\":");
  if (at == std::string::npos) throw std::runtime_error("no " + key + " in " + body);
  return std::stod(body.substr(at + key.size() + 3));
}

double Answer::sum(const std::string& key) const {
  const std::string before = "\"" + key + "\":";
  double all = 0;
  for (auto at = body.find(before); at != std::string::npos; at = body.find(before, at + 1)) {
    all += std::stod(body.substr(at + before.size()));
  }
  return all;
}

Answer ask(const std::string& path, const std::string& request, const std::string& body) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy_n(path.begin(), std::min(path.size(), sizeof address.sun_path - 1), address.sun_path);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string text;
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    const auto space = request.find(' ');
    std::string all = request.substr(0, space) + " /api/v1" + request.substr(space + 1) +
                      " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
    if (!body.empty()) all += "Content-Type: application/json\r\n";
    all += "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
    ::send(fd, all.data(), all.size(), MSG_NOSIGNAL);
    std::array<char, 4096> buffer;
    ssize_t size = 0;
    while ((size = ::recv(fd, buffer.data(), buffer.size(), 0)) > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(size));
    }
  }
  ::close(fd);
  const auto end = text.find("\r\n\r\n");
  if (end == std::string::npos) return {};
  return {std::stoi(text.substr(text.find(' '))), text.substr(end + 4)};
}

}  // namespace lk::host

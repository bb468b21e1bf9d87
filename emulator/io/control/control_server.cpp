#include "emulator/io/control/control_server.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <system_error>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/runtime_dir.hpp"

namespace lk::emulator {
namespace {

using boost::system::error_code;

constexpr std::size_t kShortestToken = 16;
// A page sends the token in hexadecimal; this length still fits into a header (kLongestHeader).
constexpr std::size_t kLongestToken = 2048;

/// Returns true for a systemd credential. Access lists protect it, which its mode does not show.
bool is_credential(const std::filesystem::path& file) {
  const char* const directory = std::getenv("CREDENTIALS_DIRECTORY");
  return directory != nullptr && *directory == '/' && file.parent_path() == directory;
}

std::string read_token(const std::filesystem::path& file) {
  const std::string name = file.string();
  const int fd = ::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    throw StartError("--http-token: cannot read " + name + ": " +
                     std::generic_category().message(errno));
  }
  struct stat found {};
  ::fstat(fd, &found);
  // 3 more bytes: "\r\n", and one that shows that the token is too long.
  std::string token(kLongestToken + 3, '\0');
  const ssize_t size = S_ISREG(found.st_mode) ? ::read(fd, token.data(), token.size()) : -1;
  ::close(fd);
  if (size < 0) throw StartError("--http-token: " + name + " is not a readable file");
  if ((found.st_mode & 077) != 0 && !is_credential(file)) {
    throw StartError("--http-token: others can read " + name + ": chmod 600 " + name);
  }
  token.resize(static_cast<std::size_t>(size));
  while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
  if (token.size() < kShortestToken) {
    throw StartError("--http-token: the token in " + name + " is shorter than " +
                     std::to_string(kShortestToken) + " characters");
  }
  if (token.size() > kLongestToken) {
    throw StartError("--http-token: the token in " + name + " is longer than " +
                     std::to_string(kLongestToken) + " characters");
  }
  return token;
}

}  // namespace

ControlServer::ControlServer(boost::asio::io_context& loop, World& world,
                             const ControlOptions& options)
    : loop_(loop), shared_(std::make_shared<HttpShared>(world)), timeouts_(options.timeouts) {
  // TCP first: if it fails, no socket file exists yet.
  if (options.http) listen_at(*options.http, options);
  if (options.socket.empty()) {
    try {
      secure_directory(runtime_directory());
      remove_dead_sockets();
      listen_at(runtime_directory() / (bus_file_name(world.lines().front()->name()) + "-" +
                                       std::to_string(::getpid()) + ".sock"));
    } catch (const StartError& problem) {
      spdlog::warn(
          "no control socket: {} (choose another with --control PATH, or none with --control none)",
          problem.what());
    }
  } else if (options.socket != "none") {
    listen_at(std::filesystem::path(options.socket));
  }
}

void ControlServer::listen_at(const std::filesystem::path& path) {
  const auto endpoint = std::make_shared<HttpEndpoint>();
  endpoint->timeouts = timeouts_;
  endpoint->same_user = true;
  unix_.emplace(loop_, path, serving(endpoint));
  spdlog::debug("control: {}", path.string());
}

void ControlServer::listen_at(const HttpAddress& http, const ControlOptions& options) {
  error_code error;
  const auto address = boost::asio::ip::make_address(http.address, error);
  if (error) {
    throw StartError("--http: \"" + http.address +
                     "\" is not an IP address, like 127.0.0.1 or ::1");
  }
  const auto endpoint = std::make_shared<HttpEndpoint>();
  endpoint->timeouts = timeouts_;
  Access& access = endpoint->access;
  access.open_to_others = options.open_to_others;
  access.pages_may_write = options.pages_may_write;
  endpoint->page_language = options.page_language;
  if (!options.token_file.empty()) access.token = read_token(options.token_file);
  if (!address.is_loopback() && access.token.empty() && !options.open_to_others) {
    throw StartError("--http: others can reach " + http.address +
                     ": give a --http-token FILE, or none");
  }
  access.own_pages_only = address.is_loopback() || access.token.empty();
  tcp_.emplace(loop_, address, http.port, serving(endpoint));
  const std::string host = url_host(address);
  if (!address.is_loopback() && access.token.empty()) {
    spdlog::warn("--http: anyone who can reach {} can look at these drives{}{}", host,
                 options.pages_may_write ? " and command them" : "",
                 address.is_unspecified() ? "; that is all addresses of this machine" : "");
  }
  spdlog::info("dashboard: http://{0}:{1}/, control: http://{0}:{1}/api/v1", host, port());
}

/// Makes room for a new connection by closing the one that has been idle longest.
bool ControlServer::has_room(HttpEndpoint& endpoint) {
  if (endpoint.connections < kMaxConnections) return true;
  if (endpoint.idle.empty()) {
    log_refusal(endpoint, "connection",
                "connection: there are " + std::to_string(kMaxConnections) + " already");
    return false;
  }
  const auto close = endpoint.idle.front();  // removes itself from `idle`
  close();
  return true;
}

SocketListener::OnConnect ControlServer::serving(std::shared_ptr<HttpEndpoint> endpoint) {
  return [shared = shared_, endpoint = std::move(endpoint)](HttpSocket socket) {
    if (has_room(*endpoint)) serve_http(std::move(socket), shared, endpoint);
  };
}

}  // namespace lk::emulator

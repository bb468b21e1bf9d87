// Thousands of malicious clients at both entrances of the control interface, while a host keeps
// querying. Each kind is refused, without effect on drives or memory.

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <future>

#include "tests/host/machine_support.hpp"
#include "tests/support/sanitizer.hpp"

namespace lk::host {
namespace bad_clients_test {

constexpr int kClients = 1000;
const std::string kToken = "0123456789abcdef0123";

/// The two entrances.
struct Doors {
  std::string path;  // of the Unix socket
  std::uint16_t port = 0;

  std::string host() const { return "127.0.0.1:" + std::to_string(port); }
};

enum class Door : std::uint8_t { kUnix, kTcp };

/// A client that sends this text.
struct Kind {
  const char* name;
  Door door;
  std::string text;
  int status;  // HTTP status of the answer; 0: none, since the request never ends
};

std::string get_text(const std::string& what, const std::string& headers) {
  return "GET " + what + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n";
}

Kind good_one(Door door, const Doors& doors) {
  return {"a good one", door,
          get_text("/api/v1/clock",
                   "Host: " + doors.host() + "\r\nAuthorization: Bearer " + kToken + "\r\n"),
          200};
}

std::vector<Kind> bad_ones(const Doors& doors) {
  const std::string host = "Host: " + doors.host() + "\r\n";
  const std::string token = "Authorization: Bearer " + kToken + "\r\n";
  const std::string post =
      "POST /api/v1/directives HTTP/1.1\r\nContent-Type: application/json\r\n"
      "Connection: close\r\n";
  const std::string deep(10'000, '[');
  const std::string status = "/api/v1/status";
  return {
      {"silence", Door::kUnix, "", 0},
      {"half a request", Door::kUnix, "GET /api/v1/st", 0},
      {"an endless body", Door::kUnix,
       post + "Transfer-Encoding: chunked\r\n\r\nfffffff\r\n" + std::string(100'000, '['), 413},
      {"a foreign Host", Door::kTcp, get_text(status, "Host: evil.example\r\n" + token), 403},
      {"a foreign Origin", Door::kTcp,
       get_text(status, host + token + "Origin: http://evil.example\r\n"), 403},
      {"no token", Door::kTcp, get_text(status, host), 401},
      {"a wrong token", Door::kTcp,
       get_text(status, host + "Authorization: Bearer 0123456789abcdef0124\r\n"), 401},
      {"a climbing path", Door::kTcp, get_text("/api/../../etc/passwd", host + token), 404},
      {"a deep body", Door::kTcp,
       post + host + token + "Content-Length: " + std::to_string(deep.size()) + "\r\n\r\n" + deep,
       400},
  };
}

int connected(int family, const sockaddr* address, socklen_t size) {
  const int fd = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval patience{kPatience_ms / 1000, 0};  // so that a failing test ends
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(fd, address, size) == 0) return fd;
  ::close(fd);
  return -1;
}

int connect_to(Door door, const Doors& doors) {
  if (door == Door::kUnix) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(doors.path.begin(), doors.path.end(), std::begin(address.sun_path));
    return connected(AF_UNIX, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(doors.port);
  return connected(AF_INET, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

/// Returns all that the client receives until the connection ends.
std::string answer_to(const Kind& kind, const Doors& doors) {
  const int fd = connect_to(kind.door, doors);
  if (fd < 0) return "";
  ::send(fd, kind.text.data(), kind.text.size(), MSG_NOSIGNAL);
  std::string answer;
  char bytes[4096];
  for (ssize_t size = 0; (size = ::recv(fd, bytes, sizeof bytes, 0)) > 0;) {
    answer.append(bytes, static_cast<std::size_t>(size));
  }
  ::close(fd);
  return answer;
}

/// Returns the status of an answer, or 0 without one.
int status_of(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9)) : 0;
}

/// Closes the connections once the server has accepted all: the last client has been answered or
/// refused.
void let_go(std::vector<int>& held, const Doors& doors) {
  for (const Door door : {Door::kUnix, Door::kTcp}) answer_to(good_one(door, doors), doors);
  for (const int one : held) ::close(one);
  held.clear();
}

/// Opens clients of all kinds in turn, many at a time, without waiting for answers.
void attack(const std::vector<Kind>& kinds, const Doors& doors) {
  constexpr std::size_t kAtOnce = 200;
  std::vector<int> held;
  for (std::size_t n = 0; n < kClients; ++n) {
    const Kind& kind = kinds[n % kinds.size()];
    const int fd = connect_to(kind.door, doors);
    if (fd < 0) continue;
    ::send(fd, kind.text.data(), kind.text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    held.push_back(fd);
    if (held.size() == kAtOnce) let_go(held, doors);
  }
  let_go(held, doors);
}

/// Resets the kernel's peak of resident memory (proc(5), clear_refs).
void reset_peak_memory(pid_t pid) {
  std::ofstream file("/proc/" + std::to_string(pid) + "/clear_refs");
  file << "5" << std::flush;
  ASSERT_TRUE(file.good());
}

/// Returns the peak of resident memory.
std::uint64_t peak_KiB(pid_t pid) {
  const std::string status = text_of("/proc/" + std::to_string(pid) + "/status");
  const auto at = status.find("VmHWM:");
  return at == std::string::npos ? 0 : std::stoull(status.substr(at + 6));
}

class BadClients : public MachineTest {
 protected:
  /// Returns options to listen at both entrances.
  std::vector<std::string> with_tcp() const {
    std::ofstream(path("token")) << kToken << '\n';
    std::filesystem::permissions(
        path("token"), std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    return arguments({"--http", "127.0.0.1:0", "--http-token", path("token")});
  }
  /// Pre: the program is ready, so its log contains the port.
  Doors doors_of(EmulatorProcess& emulator) const {
    const std::string before = "control: http://127.0.0.1:";
    if (!emulator.wait_for_log("/api/v1")) throw std::runtime_error("no port in the log");
    const auto at = emulator.log().find(before) + before.size();
    return {socket(), static_cast<std::uint16_t>(std::stoul(emulator.log().substr(at)))};
  }
};

TEST_F(BadClients, AffectNeitherBusNorMemory) {
  StartedEmulator emulator(with_tcp());
  const Doors doors = doors_of(emulator);
  const std::vector<Kind> kinds = bad_ones(doors);
  for (const Kind& kind : kinds) {
    if (kind.status == 0) continue;
    const std::string answer = answer_to(kind, doors);
    EXPECT_EQ(status_of(answer), kind.status) << kind.name << ": " << answer;
  }
  for (const Door door : {Door::kUnix, Door::kTcp}) {
    EXPECT_EQ(status_of(answer_to(good_one(door, doors), doors)), 200);
  }

  reset_peak_memory(emulator.pid());
  const std::uint64_t before_KiB = peak_KiB(emulator.pid());
  std::uint64_t most_KiB[2] = {};
  Host host(own_bus());
  int queries = 0;
  for (std::uint64_t& peak : most_KiB) {
    const auto attacked = std::async(std::launch::async, attack, kinds, doors);
    do {
      EXPECT_TRUE(host.query(2, kReadState2)) << queries;
      ++queries;
    } while (attacked.wait_for(std::chrono::seconds(0)) != std::future_status::ready);
    for (const Door door : {Door::kUnix, Door::kTcp}) {
      EXPECT_TRUE(wait_until([&] {
        return status_of(answer_to(good_one(door, doors), doors)) == 200;
      })) << "there is room again";
    }
    peak = peak_KiB(emulator.pid());
  }
  if (!kAddressSanitizer) {
    // With all 128 holding a whole body and the maximal read-ahead it would be 10 MiB.
    EXPECT_LT(most_KiB[0], before_KiB + 4096);
    // The first thousand leave nothing behind: less than half a KiB each.
    EXPECT_LT(most_KiB[1], most_KiB[0] + kClients / 2);
  }
  std::printf(
      "twice %d bad clients: %llu KiB before, %llu and %llu at most; %d queries, all answered\n",
      kClients, static_cast<unsigned long long>(before_KiB),
      static_cast<unsigned long long>(most_KiB[0]), static_cast<unsigned long long>(most_KiB[1]),
      queries);

  const auto exit = emulator.stop();
  EXPECT_EQ(exit.status, 0);
  constexpr const char* kTold[] = {"413 request",       "403 Host", "403 Origin",
                                   "401 Authorization", "404 path", "400 body"};
  for (const char* refusal : kTold) {
    EXPECT_EQ(count_of(exit.err, std::string("refused: ") + refusal), 1) << refusal << exit.err;
  }
  // Also at each entrance: too many connections, or a request that took too long.
  EXPECT_LE(count_of(exit.err, "refused: "), static_cast<int>(std::size(kTold)) + 3) << exit.err;
}

}  // namespace bad_clients_test
}  // namespace lk::host

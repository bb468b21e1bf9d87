// Frames of all kinds at the kernel's maximal rate, while a host keeps querying. Its queries are
// answered or counted as lost. After the flood the program is in its earlier state.

#include <gtest/gtest.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace flood_test {

using Clock = std::chrono::steady_clock;

constexpr canid_t kAsked = 0x142;  // the flood does not address this drive
constexpr int kQueries = 300;

// --- flood

/// Returns a frame of any kind, identifier, length and data; half of them are commands to drive 1.
canfd_frame any_frame(std::mt19937& random) {
  canfd_frame frame{};
  for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random());
  frame.len = static_cast<std::uint8_t>(random() % 9);
  frame.can_id = static_cast<canid_t>(random()) & CAN_SFF_MASK;
  switch (random() % 8) {
    case 0:
      frame.can_id = (static_cast<canid_t>(random()) & CAN_EFF_MASK) | CAN_EFF_FLAG;
      break;
    case 1:
      frame.can_id |= CAN_RTR_FLAG;
      break;
    case 2:
      frame.can_id |= CAN_ERR_FLAG | 1;  // the kernel delivers no error frames of class 0
      break;
    case 3:
      frame.can_id = 0x280;
      frame.len = 8;
      break;
    default:
      frame.can_id = 0x141;
      frame.len = 8;
  }
  if ((frame.can_id & CAN_SFF_MASK) == kAsked) frame.can_id ^= 1U << 9U;
  return frame;
}

/// Sends until stopped.
class Flood {
 public:
  explicit Flood(const std::string& interface)
      : host_(interface), thread_([this] {
          std::mt19937 random(1);
          while (!over_) send(any_frame(random), random() % 16 == 0);
        }) {}
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  ~Flood() { stop(); }

  /// Stops; returns the number of frames sent.
  std::uint64_t stop() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
    return sent_;
  }
  std::uint64_t so_far() const { return sent_; }

 private:
  void send(const canfd_frame& frame, bool fd) {
    try {
      if (fd) {
        host_.send(frame);
      } else {
        can_frame classic{};
        classic.can_id = frame.can_id;
        classic.len = frame.len;
        std::copy_n(frame.data, sizeof classic.data, classic.data);
        host_.send(classic);
      }
      ++sent_;
    } catch (const std::system_error&) {  // the queue is full, or the interface lacks CAN FD
    }
  }

  Host host_;
  std::atomic<bool> over_{false};
  std::atomic<std::uint64_t> sent_{0};
  std::thread thread_;
};

/// A host that receives one drive only, so that its socket does not overflow.
class Asker {
 public:
  Asker() : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)) {
    const can_filter mine{kAsked, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
    ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, &mine, sizeof mine);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex("vcan0"));
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  Asker(const Asker&) = delete;
  Asker& operator=(const Asker&) = delete;
  ~Asker() { ::close(fd_); }

  void ask() {
    can_frame query{};
    query.can_id = kAsked;
    query.len = 8;
    query.data[0] = 0x9C;
    while (::write(fd_, &query, sizeof query) != sizeof query) {
    }
    ++asked;
  }
  /// Receives one answer within `patience_ms`; returns whether it came.
  bool hear(int patience_ms) {
    pollfd readable{fd_, POLLIN, 0};
    if (::poll(&readable, 1, patience_ms) < 1) return false;
    can_frame reply{};
    EXPECT_EQ(::read(fd_, &reply, sizeof reply), static_cast<ssize_t>(sizeof reply));
    EXPECT_EQ(reply.data[0], 0x9C);
    ++answered;
    return true;
  }

  std::uint64_t asked = 0;
  std::uint64_t answered = 0;

 private:
  int fd_;
};

// --- the control interface

int connect_to(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), std::begin(address.sun_path));
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  ::close(fd);
  return -1;
}

/// Returns the answer to a GET; empty if there is none.
std::string ask_control(const std::string& path, const std::string& what) {
  const int fd = connect_to(path);
  const std::string request =
      "GET /api/v1" + what + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
  if (::write(fd, request.data(), request.size()) < 0) return "";
  std::string answer;
  char bytes[4096];
  for (ssize_t size = 0; (size = ::read(fd, bytes, sizeof bytes)) > 0;) {
    answer.append(bytes, static_cast<std::size_t>(size));
  }
  ::close(fd);
  return answer;
}

/// Returns the number of a key. Pre: the JSON has the key once.
std::uint64_t number(const std::string& text, const std::string& key) {
  const auto at = text.find("\"" + key + "\":");
  EXPECT_NE(at, std::string::npos) << key << " in " << text;
  return at == std::string::npos ? 0 : std::stoull(text.substr(at + key.size() + 3));
}

/// Returns the sum of the numbers in the object "dropped".
std::uint64_t dropped(const std::string& text) {
  const auto begin = text.find("\"dropped\":{");
  const auto end = text.find('}', begin);
  std::uint64_t sum = 0;
  for (auto at = text.find(':', begin + 11); at < end; at = text.find(':', at + 1)) {
    sum += std::stoull(text.substr(at + 1));
  }
  return sum;
}

// --- tests

class Flooded : public testing::Test {
 protected:
  std::string socket() const { return own_.path("s"); }
  std::vector<std::string> arguments(const std::string& bitrate) const {
    return {"--rom", ":memory:", "--control", socket(), "--bitrate",
            bitrate, "--bus",    "vcan0",     "--ids",  "1-2"};
  }
  std::string status() const { return ask_control(socket(), "/status"); }
  /// Queries until the program has no backlog.
  std::string status_when_quiet(Asker& asker) const {
    std::string before;
    std::string now = status();
    do {
      asker.ask();
      asker.hear(kPatience_ms);
      before = now;
      now = status();
    } while (number(now, "frames") != number(before, "frames") + 1);
    return now;
  }

  void flood(const std::string& bitrate);

  const test::TempDirectory own_;
};

void Flooded::flood(const std::string& bitrate) {
  EmulatorProcess emulator(arguments(bitrate));
  ASSERT_TRUE(emulator.wait_ready());
  Asker asker;
  Flood flood("vcan0");
  std::vector<double> answers_ms;
  for (int n = 0; n < kQueries; ++n) {
    asker.ask();
    while (asker.hear(1)) {
    }
    if (n % 10 != 0) continue;
    const auto begin = Clock::now();
    ASSERT_NE(status().find("200 OK"), std::string::npos) << "it answers in the flood too";
    answers_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
  }
  const std::uint64_t sent = flood.stop();
  while (asker.hear(200)) {  // pending answers
  }
  const std::string quiet = status_when_quiet(asker);
  const std::uint64_t kernel = number(quiet, "kernel_drops");
  // The drive has answered all received queries; the others are counted as dropped, for reasons
  // such as a full queue.
  const std::uint64_t taken = number(ask_control(socket(), "/drives/vcan0/2"), "queries");
  EXPECT_GT(taken, 0U);
  EXPECT_EQ(asker.answered, taken);
  EXPECT_LE(asker.asked - taken,
            kernel + number(quiet, "queue_full") + number(quiet, "drive_busy"));
  if (bitrate == "0") {
    EXPECT_LE(asker.asked - taken, kernel) << "there is no queue";
  }
  EXPECT_EQ(number(quiet, "drive_without_power") + number(quiet, "injected_fault"), 0U);
  EXPECT_EQ(number(quiet, "queries") + dropped(quiet), number(quiet, "frames"));
  if (bitrate != "0") {  // without a wire, the kernel filters frames for absent drives
    EXPECT_EQ(number(quiet, "frames") + kernel, sent + asker.asked);
  }
  EXPECT_GT(sent, asker.asked);
  std::ranges::sort(answers_ms);
  std::printf(
      "bit rate %s: %llu frames of the flood, %llu frames on the bus, %llu dropped by the kernel; "
      "%llu queries, %llu answered; /status in %.1f ms (median), %.1f ms (slowest)\n",
      bitrate.c_str(), static_cast<unsigned long long>(sent),
      static_cast<unsigned long long>(number(quiet, "frames")),
      static_cast<unsigned long long>(kernel), static_cast<unsigned long long>(asker.asked),
      static_cast<unsigned long long>(asker.answered), answers_ms[answers_ms.size() / 2],
      answers_ms.back());
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST_F(Flooded, CountsEveryFrameAtABitRate) { flood("1000000"); }

TEST_F(Flooded, CountsEveryQueryWithoutABitRate) { flood("0"); }

}  // namespace flood_test
}  // namespace lk::host

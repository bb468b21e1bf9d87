// Frames of all kinds at the kernel's maximal rate, while a host keeps querying. Its queries are
// answered or counted as lost. After the flood the program is in its earlier state.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/host/machine_support.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace flood_test {

constexpr int kAskedId = 2;  // the flood does not address this drive
constexpr canid_t kAsked = 0x140 + kAskedId;
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
  Asker() { host_.hear_only({kAskedId}); }

  void ask() {
    while (!sent()) {
    }
    ++asked;
  }
  /// Receives one answer within `patience_ms`; returns whether it came.
  bool hear(int patience_ms) {
    const auto reply = host_.receive(patience_ms);
    if (!reply) return false;
    EXPECT_EQ(reply->data[0], kReadState2[0]);
    ++answered;
    return true;
  }

  std::uint64_t asked = 0;
  std::uint64_t answered = 0;

 private:
  bool sent() const {
    try {
      host_.send(kAsked, kReadState2);
      return true;
    } catch (const std::system_error&) {  // the queue is full
      return false;
    }
  }

  Host host_{"vcan0"};
};

// --- the control interface

std::uint64_t number(const Answer& answer, const std::string& key) {
  return static_cast<std::uint64_t>(answer.number(key));
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

class Flooded : public MachineTest {
 protected:
  Flooded() : MachineTest("vcan0") {}

  Answer status() const { return get("/status"); }
  /// Queries until the program has no backlog.
  Answer status_when_quiet(Asker& asker) const {
    Answer before;
    Answer now = status();
    do {
      asker.ask();
      asker.hear(kPatience_ms);
      before = now;
      now = status();
    } while (number(now, "frames") != number(before, "frames") + 1);
    return now;
  }

  void flood(const std::string& bitrate);
};

void Flooded::flood(const std::string& bitrate) {
  ReadyEmulator emulator(arguments({"--bitrate", bitrate}));
  Asker asker;
  Flood flood("vcan0");
  std::vector<double> answers_ms;
  for (int n = 0; n < kQueries; ++n) {
    asker.ask();
    while (asker.hear(1)) {
    }
    if (n % 10 != 0) continue;
    const auto begin = MonoClock::now();
    ASSERT_EQ(status().status, 200) << "it answers in the flood too";
    answers_ms.push_back(
        std::chrono::duration<double, std::milli>(MonoClock::now() - begin).count());
  }
  const std::uint64_t sent = flood.stop();
  while (asker.hear(200)) {  // pending answers
  }
  const Answer quiet = status_when_quiet(asker);
  const std::uint64_t kernel = number(quiet, "kernel_drops");
  // The drive has answered all received queries; the others are counted as dropped, for reasons
  // such as a full queue.
  const std::uint64_t taken = number(get("/drives/vcan0/2"), "queries");
  EXPECT_GT(taken, 0U);
  EXPECT_EQ(asker.answered, taken);
  EXPECT_LE(asker.asked - taken,
            kernel + number(quiet, "queue_full") + number(quiet, "drive_busy"));
  if (bitrate == "0") {
    EXPECT_LE(asker.asked - taken, kernel) << "there is no queue";
  }
  EXPECT_EQ(number(quiet, "drive_without_power") + number(quiet, "injected_fault"), 0U);
  EXPECT_EQ(number(quiet, "queries") + dropped(quiet.body), number(quiet, "frames"));
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

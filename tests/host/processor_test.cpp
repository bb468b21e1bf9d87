// A process that is stopped for seconds.

#include <csignal>
#include <map>

#include "tests/host/machine_support.hpp"

namespace lk::host {
namespace processor_test {

using Processor = MachineTest;

/// On a busy machine time may slip again later: this is reported as another episode, after the end
/// of the first.
TEST_F(Processor, SlipsAndAnswersQueuedFramesAfterAStop) {
  StartedEmulator emulator(arguments());
  Host host(bus_);
  const Reading begin = read_clock();
  ASSERT_TRUE(suspend(emulator));
  const auto stopped = MonoClock::now();
  constexpr int kFrames = 500;  // fits into a socket buffer
  for (int n = 0; n < kFrames; ++n) host.send(0x141U + static_cast<canid_t>(n % 4), kReadState2);
  // The test needs this pause, so it waits for a fixed time.
  EXPECT_FALSE(host.receive(2000)) << "it is stopped";
  const double pause_s = std::chrono::duration<double>(MonoClock::now() - stopped).count();
  emulator.signal(SIGCONT);
  std::map<canid_t, int> replies;  // the lowest identifier wins arbitration
  for (int n = 0; n < kFrames; ++n) {
    const auto reply = host.receive();
    ASSERT_TRUE(reply) << n;
    ++replies[reply->can_id];
  }
  constexpr int kEach = kFrames / 4;
  EXPECT_EQ(replies, (std::map<canid_t, int>{
                         {0x141, kEach}, {0x142, kEach}, {0x143, kEach}, {0x144, kEach}}));
  const Reading end = read_clock();
  expect_no_drift(begin, end);
  EXPECT_GE(end.slipped_s - begin.slipped_s, pause_s - 0.051) << "no more than 50 ms are made up";
  expect_balanced(kFrames);
  const auto result = emulator.stop();
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.out.find("simulated time slipped"), std::string::npos) << result.out;
  const int episodes = count_of(result.err, "simulated time slips");
  EXPECT_GE(episodes, 1) << result.err;
  EXPECT_LE(episodes, 1 + count_of(result.err, "keeping up again")) << result.err;
}

}  // namespace processor_test
}  // namespace lk::host

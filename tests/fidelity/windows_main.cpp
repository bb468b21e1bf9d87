/// @file Windows of telemetry for classifiers: fidelity_windows [MOVES] prints CSV. A window is ten
/// samples of 0x9C, about 12 ms apart, of the log's move on emulated drives
/// (docs/internals/fidelity.md).

#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/fidelity/joint_log.hpp"

namespace lk::test {
namespace {

constexpr std::size_t kWindow = 10;  // samples

void print_head() {
  std::string head = "part,move,first_sample";
  for (const char* quantity : {"speed_dps", "iq_lsb", "encoder_error_counts"}) {
    for (std::size_t n = 0; n < kWindow; ++n) head += "," + (quantity + ("_" + std::to_string(n)));
  }
  std::puts(head.c_str());
}

/// Prints the consecutive windows that fit into samples `from` to `to` − 1.
void print_windows(const char* part, std::uint64_t move, const JointLog& log, std::size_t from,
                   std::size_t to) {
  for (; from + kWindow <= to; from += kWindow) {
    std::printf("%s,%llu,%zu", part, static_cast<unsigned long long>(move), from);
    for (std::size_t n = 0; n < kWindow; ++n) std::printf(",%g", log.samples[from + n].speed_dps);
    for (std::size_t n = 0; n < kWindow; ++n) std::printf(",%g", log.samples[from + n].iq_lsb);
    for (std::size_t n = 0; n < kWindow; ++n)
      std::printf(",%d", log.samples[from + n].error_counts);
    std::puts("");
  }
}

}  // namespace
}  // namespace lk::test

int main(int argc, char** argv) {
  using namespace lk::test;
  const int moves = argc > 1 ? std::atoi(argv[1]) : static_cast<int>(kMoves);
  if (argc > 2 || moves < 1 || moves > 10'000) {
    std::fputs("usage: fidelity_windows [MOVES]: 1 to 10000 moves, 12 without\n", stderr);
    return 2;
  }
  print_head();
  for (std::uint64_t move = 1; move <= static_cast<std::uint64_t>(moves); ++move) {
    const JointLog log = move_joint(move, kJitter_us);
    print_windows("start", move, log, 0, kWindow);
    print_windows("cruise", move, log, 16, log.stop_begins - 4);
    print_windows("stop", move, log, log.stop_begins - 2, log.stop_begins + 8);
    print_windows("hold", move, log, kTravelSamples, log.samples.size());
  }
}

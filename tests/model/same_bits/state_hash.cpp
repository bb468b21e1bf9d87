// Prints a hash of the states of several different drives over a mixed run, and one line per drive
// for diagnosis. Includes the whole model, so that one compiler call builds it with one set of
// options.
#include <cstdio>

// NOLINTBEGIN(bugprone-suspicious-include)
#include "model/control/current_loop_params.cpp"
#include "model/control/motion_loops.cpp"
#include "model/control/protection.cpp"
#include "model/drive_bank.cpp"
#include "model/drive_bank_faults.cpp"
#include "model/drive_bank_mount.cpp"
#include "model/fault_effects.cpp"
#include "model/lane_kernel.cpp"
#include "model/plant/broken_legs.cpp"
#include "model/plant/faulty_params.cpp"
#include "model/plant/lane_faults.cpp"
#include "model/plant/leg_bridge.cpp"
#include "model/plant/plant_params.cpp"
// NOLINTEND(bugprone-suspicious-include)
#include "tests/model/mixed_run.hpp"

int main() {  // NOLINT(bugprone-exception-escape): without memory nothing is printed
#if defined(__AVX512F__)
  if (!__builtin_cpu_supports("avx512f")) {
    std::puts("not run: this processor has no AVX-512");
    return 77;
  }
#elif defined(__AVX2__)
  if (!__builtin_cpu_supports("avx2")) {
    std::puts("not run: this processor has no AVX2");
    return 77;
  }
#endif
  using namespace lk::model;
  using namespace lk::model::test;
  Hash all;
  const auto print = [&all](const char* how, int kind, const std::vector<std::uint64_t>& words) {
    Hash one;
    for (const std::uint64_t word : words) {
      one.add(word);
      all.add(word);
    }
    std::printf("%s %2d %016llx\n", how, kind, static_cast<unsigned long long>(one.value()));
  };
  const auto together = mixed_run({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, lane_kernel("baseline"));
  for (std::size_t n = 0; n < together.size(); ++n) {
    print("lanes", static_cast<int>(n), together[n]);
  }
  const auto broken =
      mixed_run({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, lane_kernel("baseline"), kStretchTicks, true);
  for (std::size_t n = 0; n < broken.size(); ++n) {
    print("broken", static_cast<int>(n), broken[n]);
  }
  for (const int kind : {2, 4, 5}) {
    print("alone", kind, mixed_run({kind}, lane_kernel("baseline")).front());
  }
  std::printf("all %016llx\n", static_cast<unsigned long long>(all.value()));
}

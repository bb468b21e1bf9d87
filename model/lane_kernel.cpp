#include "model/lane_kernel.hpp"

#include "model/stored_real.hpp"
#include "model/tick.hpp"

namespace lk::model {

// `flatten` inlines all calls, so that the tick is straight-line code.
[[gnu::flatten]] void run_alone_baseline(TickBlock<double>& block, const Stretch& stretch) {
  run_block<Solo>(block, stretch);
}

[[gnu::flatten]] void run_lanes_baseline(TickBlock<Wide>& block, const Stretch& stretch) {
  run_block<Lanes>(block, stretch);
}

void run_alone_faulty(TickBlock<double>& block, const Stretch& stretch) {
  run_block<Solo, true>(block, stretch);
}

void run_lanes_faulty_baseline(TickBlock<Wide>& block, const Stretch& stretch) {
  run_block<Lanes, true>(block, stretch);
}

NamedKernel lane_kernel(std::string_view name) {
  if (name == "baseline") {
    return {"baseline", run_lanes_baseline, run_alone_baseline, kSizeOf<Lanes>,
            run_lanes_faulty_baseline};
  }
#ifdef LKEMU_X86_KERNELS
  if (name == "avx2" && __builtin_cpu_supports("avx2")) {
    return {"avx2", run_lanes_avx2, run_alone_avx2, kLanes, run_lanes_faulty_avx2};
  }
  if (name == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    // A single drive uses the AVX2 kernel: it does not fill a register, and AVX-512 masks would
    // make its selects slower.
    return {"avx512", run_lanes_avx512, run_alone_avx2, kLanes, run_lanes_faulty_avx512};
  }
#endif
  return {};
}

NamedKernel best_lane_kernel() {
  for (const std::string_view name : {"avx512", "avx2"}) {
    if (const NamedKernel kernel = lane_kernel(name); kernel.run != nullptr) {
      return kernel;
    }
  }
  return lane_kernel("baseline");
}

}  // namespace lk::model

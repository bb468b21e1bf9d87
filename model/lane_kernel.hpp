#pragma once

/// @file Kernels: the fast tick of eight drives, compiled for several instruction sets. The program
/// chooses one at start.

#include <cstddef>
#include <string_view>

namespace lk::model {

// Forward declarations: callers need not include model/tick.hpp.
template <class Store>
struct TickBlock;
struct Wide;
struct Stretch;

using LaneKernel = void (*)(TickBlock<Wide>& block, const Stretch& stretch);
using AloneKernel = void (*)(TickBlock<double>& block, const Stretch& stretch);

struct NamedKernel {
  std::string_view name;  // "baseline", "avx2", "avx512"
  LaneKernel run = nullptr;
  AloneKernel run_single = nullptr;  // the same tick, for a bank of one drive
  std::size_t width = 1;             // number of drives that `run` computes together
  LaneKernel run_faulty = nullptr;   // for blocks with a faulty drive; same width
};

void run_alone_baseline(TickBlock<double>& block, const Stretch& stretch);
void run_alone_avx2(TickBlock<double>& block, const Stretch& stretch);
void run_lanes_baseline(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_avx2(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_avx512(TickBlock<Wide>& block, const Stretch& stretch);

void run_lanes_faulty_baseline(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_faulty_avx2(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_faulty_avx512(TickBlock<Wide>& block, const Stretch& stretch);
/// Runs a bank of one faulty drive; the same build runs on every processor.
void run_alone_faulty(TickBlock<double>& block, const Stretch& stretch);

/// Returns the fastest kernel for this processor. All kernels give bit-identical results.
NamedKernel best_lane_kernel();
/// Returns the kernel of that name; `run` is null if this build or processor does not have it.
NamedKernel lane_kernel(std::string_view name);

}  // namespace lk::model

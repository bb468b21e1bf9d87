#pragma once

/// @file The fast tick of eight drives, compiled for several instruction sets and chosen at start.

#include <cstddef>
#include <string_view>

namespace lk::model {

// model/tick.hpp has these; who only chooses a kernel need not compile them.
template <class Store>
struct TickBlock;
struct Wide;
struct Stretch;

using LaneKernel = void (*)(TickBlock<Wide>& block, const Stretch& stretch);
using AloneKernel = void (*)(TickBlock<double>& block, const Stretch& stretch);

struct NamedKernel {
  std::string_view name;  // "baseline", "avx2", "avx512"
  LaneKernel run = nullptr;
  AloneKernel run_alone = nullptr;  // the same tick for a drive that has no company
  std::size_t width = 1;            // drives of a block that `run` computes together
  LaneKernel run_faulty = nullptr;  // the tick of blocks in which some drive is faulty, as wide
};

void run_alone_baseline(TickBlock<double>& block, const Stretch& stretch);
void run_alone_avx2(TickBlock<double>& block, const Stretch& stretch);
void run_lanes_baseline(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_avx2(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_avx512(TickBlock<Wide>& block, const Stretch& stretch);

void run_lanes_faulty_baseline(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_faulty_avx2(TickBlock<Wide>& block, const Stretch& stretch);
void run_lanes_faulty_avx512(TickBlock<Wide>& block, const Stretch& stretch);
/// Of a faulty drive that has no company: one for every processor.
void run_alone_faulty(TickBlock<double>& block, const Stretch& stretch);

/// The fastest kernel this processor can run. All give the same bits.
NamedKernel best_lane_kernel();
/// Kernel by name, or one with `run == nullptr` if this build or processor does not have it.
NamedKernel lane_kernel(std::string_view name);

}  // namespace lk::model

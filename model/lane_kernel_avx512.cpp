// Compiled for AVX-512. The namespace LKEMU_ISA separates its template instances (see real.hpp).
#define LKEMU_ISA isa_avx512
#include "model/stored_real.hpp"
#include "model/tick.hpp"

namespace lk::model {

static_assert(kSizeOf<Lanes> == kLanes);

[[gnu::flatten]] void run_lanes_avx512(TickBlock<Wide>& block, const Stretch& stretch) {
  run_block<Lanes>(block, stretch);
}

[[gnu::flatten]] void run_lanes_faulty_avx512(TickBlock<Wide>& block, const Stretch& stretch) {
  run_block<Lanes, true>(block, stretch);
}

}  // namespace lk::model

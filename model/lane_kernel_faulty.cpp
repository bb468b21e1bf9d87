#include "model/lane_kernel.hpp"
#include "model/tick.hpp"

namespace lk::model {

void run_alone_faulty(TickBlock<double>& block, const Stretch& stretch) {
  run_block<Solo, true>(block, stretch);
}

void run_lanes_faulty(TickBlock<Wide>& block, const Stretch& stretch) {
  run_block<Lanes, true>(block, stretch);
}

}  // namespace lk::model

#include "emulator/core/scenario/sampler.hpp"

namespace lk::emulator {

void Sampler::sample(const Bus& bus, std::vector<double>& row) {
  row.clear();
  row.reserve(columns_.size());
  for (std::size_t n = 0; n < columns_.size();) {
    // Columns of one drive are mostly adjacent: one view serves all of them.
    const int id = columns_[n].id;
    const DriveView drive = bus.view(id);
    for (; n < columns_.size() && columns_[n].id == id; ++n) {
      row.push_back(columns_[n].signal->read(drive));
    }
  }
  next_due_ += period_;
}

}  // namespace lk::emulator

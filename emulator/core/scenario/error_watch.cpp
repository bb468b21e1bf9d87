#include "emulator/core/scenario/error_watch.hpp"

namespace lk::emulator {

ErrorWatch::ErrorWatch(const BusConfig& config, SimTime start) : start_(start), next_due_(start) {
  for (const ServoConfig& servo : config.servos) drives_.push_back({servo.id});
}

void ErrorWatch::look(const Bus& bus) {
  const SimTime now = bus.time();
  for (Watched& drive : drives_) {
    const model::ErrorBits set = bus.telemetry(drive.id).errors;
    if ((set & ~drive.seen) == 0) continue;
    for (int n = 0; n < model::kErrorKinds; ++n) {
      const auto error = static_cast<model::Error>(n);
      if ((set & ~drive.seen & model::bit(error)) != 0) {
        firsts_.push_back({drive.id, error, now - start_});
      }
    }
    drive.seen |= set;
  }
  next_due_ = now + Judge::kStep;
}

}  // namespace lk::emulator

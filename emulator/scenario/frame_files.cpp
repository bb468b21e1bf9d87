#include "emulator/scenario/frame_files.hpp"

#include "emulator/config/candump_log.hpp"
#include "emulator/scenario/pcapng.hpp"

namespace lk::emulator {

FrameFiles::FrameFiles(const FrameOutputs& outputs, std::span<const BusConfig> buses)
    : marks_(outputs.marks) {
  for (const BusConfig& bus : buses) buses_.push_back(bus.interface);
  if (outputs.candump) candump_.emplace(*outputs.candump, "--candump");
  if (!outputs.capture) return;
  capture_.emplace(*outputs.capture, "--capture");
  const std::vector<CapturedBus> captured(buses.begin(), buses.end());
  capture_->write(pcapng_begin(captured));
}

void FrameFiles::write(std::size_t bus, SimTime at, const protocol::Frame& frame, bool from_host) {
  using Direction = CandumpLine::Direction;
  if (candump_) {
    const Direction direction = !marks_     ? Direction::kUnsaid
                                : from_host ? Direction::kSent
                                            : Direction::kReceived;
    candump_->write(candump_line(at, buses_[bus], frame, direction) + '\n');
  }
  if (capture_) capture_->write(pcapng_frame(bus, at, frame, from_host));
}

void FrameFiles::commit() {
  if (candump_) candump_->commit();
  if (capture_) capture_->commit();
}

}  // namespace lk::emulator

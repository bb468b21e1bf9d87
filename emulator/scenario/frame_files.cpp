#include "emulator/scenario/frame_files.hpp"

#include <utility>

#include "emulator/config/candump_log.hpp"
#include "emulator/scenario/pcapng.hpp"

namespace lk::emulator {

FrameFiles::FrameFiles(const FrameOutputs& outputs, std::vector<std::string> buses)
    : buses_(std::move(buses)), marks_(outputs.marks) {
  if (outputs.candump) candump_.emplace(*outputs.candump, "--candump");
  if (!outputs.capture) return;
  capture_.emplace(*outputs.capture, "--capture");
  capture_->write(pcapng_begin(buses_));
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

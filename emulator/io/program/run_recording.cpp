#include "emulator/io/program/run_recording.hpp"

#include <algorithm>
#include <utility>

#include "emulator/core/start_error.hpp"

namespace lk::emulator {
namespace {

/// Returns the configurations with the present ROM contents of the drives.
std::vector<BusConfig> buses_of(const World& world) {
  std::vector<BusConfig> buses;
  for (const auto& line : world.lines()) {
    buses.push_back(line->config());
    for (ServoConfig& servo : buses.back().servos) {
      servo.rom = line->bus().servo(servo.id).rom;
      servo.wear = line->bus().servo(servo.id).wear;
    }
  }
  return buses;
}

}  // namespace

void RunRecording::start(const std::filesystem::path& directory, From from) {
  const RecordRequest request{directory, overrides_, texts_, to_string(world_.clock().mode())};
  RecordingInfo info = recording_info(request, world_.time());
  // Effects of a body on its drives are not recorded.
  const bool body = std::ranges::any_of(
      world_.lines(), [](const auto& line) { return line->config().body != nullptr; });
  info.replayable = replayable_ = from == From::kBeginning && !body;
  stop();
  previous_ = std::exchange(recorder_, std::nullopt);
  recorder_.emplace(directory, info, texts_, buses_of(world_));
  for (std::size_t n = 0; n < world_.lines().size(); ++n) {
    Listener listener;
    listener.query = [this, n](const TimedFrame& in) { recorder_->host_frame(n, in.at, in.frame); };
    listener.reply = [this, n](const TimedFrame& reply) { recorder_->reply(n, reply); };
    listener.directive = [this, n](SimTime now, const std::string& json) {
      recorder_->directive(n, now, json);
    };
    listener.restored_rom = [this, n](SimTime now, int id, const RomGate::Kept& kept) {
      recorder_->restored_rom(n, now, id, kept.rom, kept.wear);
    };
    std::list<Listener>& all = world_.lines()[n]->listeners;
    listeners_.push_back(all.insert(all.end(), std::move(listener)));
  }
}

void RunRecording::stop() {
  if (!running()) return;
  std::vector<SimTime> times;
  for (std::size_t n = 0; n < listeners_.size(); ++n) {
    world_.lines()[n]->listeners.erase(listeners_[n]);
    times.push_back(world_.lines()[n]->bus().time());
  }
  listeners_.clear();
  recorder_->end(times);
}

Json RunRecording::state() const {
  if (!running()) return nullptr;
  return {{"directory", recorder_->directory().string()},
          {"replayable", replayable_},
          {"failed", recorder_->failed()}};
}

Activity RunRecording::for_clients() {
  const auto start_for_client = [this](TableReader& request, bool /*same_user*/) {
    if (running()) throw ApiError(409, "recording", "one is running; stop it first");
    // `start` would destroy that recorder, and so wait for the disk and delay the buses.
    if (previous_ && !previous_->done()) {
      throw ApiError(409, "recording",
                     "an earlier recording is still being written; wait, or check the disk");
    }
    const std::string directory = request.required("directory", request.text("directory"));
    request.finish();
    if (directory.empty()) request.fail("directory", "needs a name");
    try {
      start(std::filesystem::absolute(directory), From::kNow);
    } catch (const StartError& problem) {
      throw ApiError(400, "directory", problem.what());
    }
    return state();
  };
  const auto stop_for_client = [this] {
    if (!running()) throw ApiError(409, "recording", "none is running");
    Json last = state();
    stop();
    return last;
  };
  return {.start = start_for_client,
          .stop = stop_for_client,
          .state = [this] { return state(); },
          .report = {}};
}

}  // namespace lk::emulator

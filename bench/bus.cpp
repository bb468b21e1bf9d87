// A whole bus: queries per second without the motors' time, and how much faster than real time a
// bus with all its motors runs.
#include "emulator/core/bus.hpp"

#include <benchmark/benchmark.h>

#include <chrono>
#include <vector>

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

BusConfig config(int drives, std::int64_t bitrate) {
  BusConfig result;
  result.bitrate = bitrate;
  for (int id = 1; id <= drives; ++id) {
    ServoConfig servo;
    servo.id = id;
    result.servos.push_back(servo);
  }
  return result;
}

/// The way of a frame alone: in, executed, out; no time passes, so no motor moves.
void BM_BusQuery(benchmark::State& state) {
  Bus bus(config(static_cast<int>(state.range(0)), 0));
  const auto query = protocol::encode_query(1, protocol::ReadState2{}, protocol::kLegacyFormat);
  std::vector<TimedFrame> replies;
  for (auto _ : state) {
    bus.receive({bus.time(), query});
    bus.advance_to(bus.time());
    replies.clear();
    bus.take_replies(replies);
    benchmark::DoNotOptimize(replies.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_BusQuery)->Arg(1)->Arg(32);

/// A loaded bus at 1 Mbit/s: one query every 250 µs to the drives in turn, 100 ms at a time.
void BM_BusLoaded(benchmark::State& state) {
  const int drives = static_cast<int>(state.range(0));
  Bus bus(config(drives, 1'000'000));
  std::vector<TimedFrame> replies;
  int id = 1;
  for (auto _ : state) {
    for (const SimTime end = bus.time() + 100ms; bus.time() < end;) {
      bus.receive(
          {bus.time(), protocol::encode_query(id, protocol::Speed{360}, protocol::kLegacyFormat)});
      bus.advance_to(bus.time() + 250us);
      replies.clear();
      bus.take_replies(replies);
      id = id % drives + 1;
    }
  }
  state.counters["times_real_time"] = benchmark::Counter(
      0.1 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(BM_BusLoaded)->Arg(1)->Arg(4)->Arg(32)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lk::emulator

// A whole bus: queries per second without motor computation, and the real-time factor of a bus with
// all its motors.
#include "emulator/core/bus/bus.hpp"

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

/// The path of a frame alone: received, executed, replied to. Time stands still, so no motor moves.
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

/// A bus at 1 Mbit/s: one query every `period` to the drives in turn, 100 ms per iteration. `bring`
/// advances the bus to the next query.
template <class Bring>
void run_talking(benchmark::State& state, SimTime period, Bring bring) {
  const int drives = static_cast<int>(state.range(0));
  Bus bus(config(drives, 1'000'000));
  std::vector<TimedFrame> replies;
  int id = 1;
  for (auto _ : state) {
    for (const SimTime end = bus.time() + 100ms; bus.time() < end;) {
      bus.receive(
          {bus.time(), protocol::encode_query(id, protocol::Speed{360}, protocol::kLegacyFormat)});
      bring(bus, bus.time() + period);
      replies.clear();
      bus.take_replies(replies);
      id = id % drives + 1;
    }
    bus.settle();
  }
  state.counters["times_real_time"] = benchmark::Counter(
      0.1 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

/// Full bus load, by a host that queries its drives.
void BM_BusLoaded(benchmark::State& state) {
  run_talking(state, 250us, [](Bus& bus, SimTime until) { bus.deliver_to(until); });
}
BENCHMARK(BM_BusLoaded)->Arg(1)->Arg(4)->Arg(32)->Unit(benchmark::kMillisecond);

/// For an observer that reads the state of all drives with each query.
void BM_BusWatched(benchmark::State& state) {
  run_talking(state, 250us, [](Bus& bus, SimTime until) { bus.advance_to(until); });
}
BENCHMARK(BM_BusWatched)->Arg(1)->Arg(4)->Arg(32)->Unit(benchmark::kMillisecond);

/// One drive in a control loop of 1 kHz, typical of most hosts.
void BM_BusControlled(benchmark::State& state) {
  run_talking(state, 1ms, [](Bus& bus, SimTime until) { bus.deliver_to(until); });
}
BENCHMARK(BM_BusControlled)->Arg(1)->Unit(benchmark::kMillisecond);

/// No traffic; 1 ms at a time, as in the program. Items are drive-ticks.
void BM_BusIdle(benchmark::State& state) {
  const int drives = static_cast<int>(state.range(0));
  Bus bus(config(drives, 1'000'000));
  for (auto _ : state) {
    bus.advance_to(bus.time() + 1ms);
  }
  state.SetItemsProcessed(state.iterations() * drives * 32);
}
BENCHMARK(BM_BusIdle)->Arg(1)->Arg(32);

}  // namespace
}  // namespace lk::emulator

// The control tick. Items are drive-ticks, so items_per_second of one and of many drives compare.
#include <benchmark/benchmark.h>

#include <vector>

#include "model/drive_bank.hpp"

namespace {

using namespace lk::model;

/// Moving drives that use all parts of the plant model.
DriveBank moving_drives(std::size_t count, NamedKernel kernel) {
  DriveInit init;
  init.params.mechanics.tau_coulomb = 0.012;
  init.params.mechanics.tau_static = 0.014;
  init.params.mechanics.B = 2e-5;
  init.params.mechanics.tau_cogging = 0.003;
  init.params.load.tau_gravity = 0.1;
  init.params.encoder.inl_1 = 1e-3;
  init.params.encoder.inl_2 = 5e-4;
  init.params.encoder.noise = 5e-5;
  std::vector<DriveInit> drives(count, init);
  for (std::size_t n = 0; n < count; ++n) {
    drives[n].seed = n + 1;
  }
  DriveBank bank(drives, kernel);
  for (std::size_t n = 0; n < count; ++n) {
    bank.command(n, Speed{10.0 + static_cast<double>(n)});
  }
  bank.advance(3200);
  return bank;
}

void run(benchmark::State& state, NamedKernel kernel, const Faults& faults = {}) {
  const auto drives = static_cast<std::size_t>(state.range(0));
  DriveBank bank = moving_drives(drives, kernel);
  for (std::size_t n = 0; n < drives; n += 4) bank.set_faults(n, faults);
  constexpr std::int64_t kTicks = 1024;
  for (auto _ : state) {
    bank.advance(kTicks);
  }
  state.SetItemsProcessed(state.iterations() * kTicks * state.range(0));
  state.SetLabel(drives == 1 ? "scalar" : std::string(kernel.name));
}

void BM_Tick(benchmark::State& state) { run(state, best_lane_kernel()); }
BENCHMARK(BM_Tick)->Arg(1)->Arg(8)->Arg(32);

/// As BM_Tick, with a named kernel.
void BM_TickKernel(benchmark::State& state, const char* name) {
  const NamedKernel kernel = lane_kernel(name);
  if (kernel.run == nullptr) {
    state.SkipWithError("not on this processor");
    return;
  }
  run(state, kernel);
}
BENCHMARK_CAPTURE(BM_TickKernel, baseline, "baseline")->Arg(32);
BENCHMARK_CAPTURE(BM_TickKernel, avx2, "avx2")->Arg(32);
BENCHMARK_CAPTURE(BM_TickKernel, avx512, "avx512")->Arg(32);

/// Every fourth drive has a fault that affects its tick: its encoder returns garbage.
void BM_TickFaulty(benchmark::State& state) {
  Faults faults;
  faults.encoder = EncoderFault::kGarbage;
  run(state, best_lane_kernel(), faults);
}
BENCHMARK(BM_TickFaulty)->Arg(1)->Arg(32);

}  // namespace

#pragma once

/// @file The fast tick: sensors → current loop → plant, once per PWM period.

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <utility>

#include "model/control/current_loop.hpp"
#include "model/plant/lane_faults.hpp"
#include "model/plant/plant.hpp"
#include "model/plant/sensors.hpp"
#include "model/stored_real.hpp"

namespace lk::model {

/// All data of the fast tick of one drive (`Store` = double) or of eight drives (`Store` = Wide).
template <class Store>
struct TickBlock {
  PlantParams<Store> plant_params;
  PlantState<Store> plant;
  CurrentLoopParams<Store> loop_params;
  CurrentLoopState<Store> loop;
  CurrentOrders<Store> orders;
  NoiseState<Store> noise;
  std::array<std::int64_t, std::tuple_size_v<decltype(noise.word)>> at{};  // ticks done, by lane
  std::array<LaneFaults, std::tuple_size_v<decltype(noise.word)>> faults{};
  bool faulty = false;  // true: LaneFaults::any() of a drive; needs a kernel with faults
};

/// Work of a kernel: the ticks up to `end` − 1 of the drives that it computes together, from drive
/// `drive` of the block on. Before each tick that is a multiple of `stride`, the kernel calls
/// `give_orders` for the drives `first` to `first + count − 1`. The callback may read the block and
/// change its orders. If other data changed too, it must return true: these drives then stop after
/// that tick.
struct Stretch {
  std::int64_t end;
  int stride;
  bool (*give_orders)(void* context, std::size_t first, std::size_t count, std::int64_t tick);
  void* context;
  std::size_t drive = 0;
};

inline namespace LKEMU_ISA {

/// Computes one period of drives that need no other parts than `parts`. The bridge uses the duties
/// of the previous period: the one-sample delay of every digital drive. Without `parts.faults`,
/// does not read `faults`.
template <Parts parts, class Real>
inline void tick(const PlantParams<Real>& plant_params, PlantState<Real>& plant,
                 const CurrentLoopParams<Real>& loop_params, CurrentLoopState<Real>& loop,
                 const CurrentOrders<Real>& orders, const Held<Real>& held, WordsOf<Real>& noise,
                 LaneFaults* faults) {
  const SinCos<Real> theta_e = sincos<Real>(plant_params.pole_pairs * plant.theta);
  const Abc<Real> i_abc = inverse_clarke(inverse_park(Dq<Real>{plant.i_d, plant.i_q}, theta_e));

  Measurement<Real> m = measure(plant_params, i_abc, plant.theta, plant.omega, noise);
  const Abc<Real> duty{loop.duty_a, loop.duty_b, loop.duty_c};
  Real bridge = loop.bridge;
  if constexpr (parts.faults) {
    falsify(faults, m, bridge);
  }
  current_loop<parts.bridge_off>(loop_params, orders, held, m, loop);
  advance<parts>(plant_params, plant, duty, bridge, i_abc, theta_e, faults);
}

/// Returns true if the drives need only kCommonParts until the next orders.
template <class Real>
inline bool is_common(const PlantParams<Real>& p, const CurrentLoopState<Real>& loop,
                      const CurrentOrders<Real>& orders) {
  return !any(p.compliant != 0.0 || p.theta_min > -kNoStop || p.theta_max < kNoStop ||
              loop.bridge == 0.0 || orders.bridge_on == 0.0);
}

template <class To, class From, class Op>
inline void for_each_field(To to, From from, Op op) {
  [&]<std::size_t... N>(std::index_sequence<N...>) {
    (op(std::get<N>(to), std::get<N>(from)), ...);
  }
  (std::make_index_sequence<std::tuple_size_v<To>>{});
}

/// Runs `stretch` for the drives of a block that one `Real` holds. Between two calls of
/// `give_orders`, the drives' data stays in registers and on the stack.
template <class Real, bool faulty = false, class Store>
inline void run_block(TickBlock<Store>& block, const Stretch& stretch) {
  const std::size_t first = kSizeOf<Real> < block.at.size() ? stretch.drive : 0;
  const auto in = [first](auto& value, const auto& stored) { load(value, stored, first); };
  const auto out = [first](auto& stored, const auto& value) { store(value, stored, first); };
  PlantParams<Real> plant_params;
  PlantState<Real> plant;
  CurrentLoopParams<Real> loop_params;
  CurrentLoopState<Real> loop;
  CurrentOrders<Real> orders;
  WordsOf<Real> noise;
  for_each_field(fields(plant_params), fields(block.plant_params), in);
  for_each_field(fields(plant), fields(block.plant), in);
  for_each_field(fields(loop_params), fields(block.loop_params), in);
  for_each_field(fields(loop), fields(block.loop), in);
  load(noise, block.noise, first);
  LaneFaults* const faults = block.faults.data() + first;
  const auto run = [&]<Parts parts>(const Held<Real>& held, std::int64_t n_ticks) {
    for (; n_ticks > 0; --n_ticks) {
      tick<parts>(plant_params, plant, loop_params, loop, orders, held, noise, faults);
    }
  };
  std::int64_t now = block.at[first];
  for (bool stop = false; now < stretch.end && !stop;) {
    if (now % stretch.stride == 0) {
      stop = stretch.give_orders(stretch.context, first, kSizeOf<Real>, now);
    }
    for_each_field(fields(orders), fields(block.orders), in);
    const Held<Real> held = hold(loop_params, orders);
    const std::int64_t end = stop ? now + 1 : stretch.end;
    const std::int64_t next = std::min(end, now - now % stretch.stride + stretch.stride);
    if constexpr (faulty) {
      run.template operator()<kFaultyParts>(held, next - now);
    } else if (is_common(plant_params, loop, orders)) {
      run.template operator()<kCommonParts>(held, next - now);
    } else {
      run.template operator()<kEveryPart>(held, next - now);
    }
    now = next;
    for_each_field(fields(block.plant), fields(plant), out);
    for_each_field(fields(block.loop), fields(loop), out);
  }
  store(noise, block.noise, first);
  std::fill_n(block.at.begin() + static_cast<std::ptrdiff_t>(first), kSizeOf<Real>, now);
}

}  // namespace LKEMU_ISA
}  // namespace lk::model

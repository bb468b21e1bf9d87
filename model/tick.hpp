#pragma once

/// @file The fast tick: sensors → current loop → plant, once per PWM period.

#include <tuple>
#include <utility>

#include "model/control/current_loop.hpp"
#include "model/plant/plant.hpp"
#include "model/plant/sensors.hpp"

namespace lk::model {

/// Everything the fast tick reads and writes: of one drive (`Store` = double) or of eight (Wide).
template <class Store>
struct TickBlock {
  PlantParams<Store> plant_params;
  PlantState<Store> plant;
  CurrentLoopParams<Store> loop_params;
  CurrentLoopState<Store> loop;
  CurrentOrders<Store> orders;
  NoiseState<Store> noise;
};

inline namespace LKEMU_ISA {

/// One period. The duties that act are those the firmware computed in the period before: the delay
/// of one sample that every digital drive has.
template <class Real>
inline void tick(const PlantParams<Real>& plant_params, PlantState<Real>& plant,
                 const CurrentLoopParams<Real>& loop_params, CurrentLoopState<Real>& loop,
                 const CurrentOrders<Real>& orders, WordsOf<Real>& noise) {
  const SinCos<Real> theta_e = sincos<Real>(plant_params.pole_pairs * plant.theta);
  const Abc<Real> i_abc = inverse_clarke(inverse_park(Dq<Real>{plant.i_d, plant.i_q}, theta_e));

  const Measurement<Real> m = measure(plant_params, i_abc, plant.theta, plant.omega, noise);
  const Abc<Real> duty{loop.duty_a, loop.duty_b, loop.duty_c};
  const Real bridge = loop.bridge;
  current_loop(loop_params, orders, m, loop);
  advance(plant_params, plant, duty, bridge, i_abc, theta_e);
}

template <class To, class From, class Op>
inline void for_each_field(To to, From from, Op op) {
  [&]<std::size_t... N>(std::index_sequence<N...>) {
    (op(std::get<N>(to), std::get<N>(from)), ...);
  }
  (std::make_index_sequence<std::tuple_size_v<To>>{});
}

/// `n_ticks` periods of the drives of a block that one `Real` holds, beginning with drive `first`.
template <class Real, class Store>
inline void run_part(TickBlock<Store>& block, std::size_t first, int n_ticks) {
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
  for_each_field(fields(orders), fields(block.orders), in);
  load(noise, block.noise.word.data() + first);
  for (int n = 0; n < n_ticks; ++n) {
    tick(plant_params, plant, loop_params, loop, orders, noise);
  }
  store(noise, block.noise.word.data() + first);
  for_each_field(fields(block.plant), fields(plant), out);
  for_each_field(fields(block.loop), fields(loop), out);
}

/// `n_ticks` periods of a whole block.
template <class Real, class Store>
inline void run_block(TickBlock<Store>& block, int n_ticks) {
  for (std::size_t first = 0; first < block.noise.word.size(); first += kSizeOf<Real>) {
    run_part<Real>(block, first, n_ticks);
  }
}

}  // namespace LKEMU_ISA
}  // namespace lk::model

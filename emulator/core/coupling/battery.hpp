#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Common battery of the drives on all buses of a robot. Each drive has its own source and cable
/// (docs/internals/model.md §5). The total current lowers the voltage of all sources equally, by
/// the drop at the inner resistance of the battery. Copies are independent.
class Battery {
 public:
  /// Returns true if a bus of the robot has drives on a battery.
  static bool needed(std::span<const BusConfig> robot);
  /// Pre: `buses` were just constructed from `robot`.
  Battery(std::span<const BusConfig> robot, std::span<Bus* const> buses);

  /// Updates the voltage drop from the current since construction or the last call, `passed` ago.
  /// The inner resistance and the link capacitors filter the drop.
  void exchange(std::span<Bus* const> buses, SimTime passed);

 private:
  struct Link {
    std::size_t bus;
    int id;
    double C_link;   // F
    double drawn_J;  // since power-up
    double v_link;   // V, at the last exchange
  };
  double R_ohm_;
  double C_F_ = 0;  // sum over all links
  double drop_V_ = 0;
  std::vector<Link> links_;
};

}  // namespace lk::emulator

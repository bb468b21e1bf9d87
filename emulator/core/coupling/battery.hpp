#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// What the drives of all buses of a robot are supplied from. Each has a source and a cable of its
/// own (docs/model.md §5); what all of them together draw costs all sources the same voltage, that
/// of the battery's inner resistance. A value.
class Battery {
 public:
  /// One of the robot's buses has drives on a battery.
  static bool needed(std::span<const BusConfig> robot);
  /// Of `buses`, which have just been made of `robot`.
  Battery(std::span<const BusConfig> robot, std::span<Bus* const> buses);

  /// So much time has passed since it was made or this was called. What the drives took in that
  /// time costs voltage from now on; their link capacitors, which the resistance charges and
  /// discharges, let it come and go.
  void exchange(std::span<Bus* const> buses, SimTime passed);

 private:
  struct Link {
    std::size_t bus;
    int id;
    double C_link;   // F
    double drawn_J;  // since power-up
    double v_link;   // V, now
  };
  double R_ohm_;
  double C_F_ = 0;  // of all links
  double drop_V_ = 0;
  std::vector<Link> links_;
};

}  // namespace lk::emulator

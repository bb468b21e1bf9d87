#pragma once

#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// A drive with nothing said about it but its motor.
ServoConfig make_servo(int id, const Profile& profile);

/// The servos of one [[bus.drive]].
std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const FindProfile& find);

}  // namespace lk::emulator

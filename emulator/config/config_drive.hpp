#pragma once

#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// A drive of which no file says anything.
ServoConfig make_servo(int id, const Profile& profile, const FirmwareRequest& asked);

/// The servos of one [[bus.drive]]; `asked` is what the command line says of this bus.
std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const FirmwareRequest& asked, const FindProfile& find);

}  // namespace lk::emulator

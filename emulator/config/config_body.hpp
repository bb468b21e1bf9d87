#pragma once

/// @file What a robot file says of its body: [body], the joints of its drives, and [battery].

#include <memory>
#include <optional>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/coupling/mechanism.hpp"

namespace lk::emulator {

/// Reads [body]; null: there is none. Throws ConfigError.
std::shared_ptr<const Mechanism> read_body(TableReader& reader, const LoadBody& load);

/// Reads [battery]: its inner resistance, ohm; 0: there is none. Throws ConfigError.
double read_battery(TableReader& reader);

/// Reads the `joint` of a drive whose other keys have been read; nothing: it has none.
std::optional<JointLink> read_joint(TableReader& reader, const ServoConfig& servo,
                                    const Mechanism* body);

/// Refuses a joint that another drive of the robot turns too. `reader` is that of `servo`; `taken`
/// has those of the drives that were read before.
void check_joint(const TableReader& reader, const ServoConfig& servo, std::vector<bool>& taken);

}  // namespace lk::emulator

#pragma once

/// @file Keys of a robot file for its body: [body], the joints of its drives, and [battery].

#include <memory>
#include <optional>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/coupling/mechanism.hpp"

namespace lk::emulator {

/// Reads [body]; null if absent. Throws ConfigError.
std::shared_ptr<const Mechanism> read_body(TableReader& reader, const LoadBody& load);

/// Reads [battery] and returns its internal resistance in ohm; 0 if absent. Throws ConfigError.
double read_battery(TableReader& reader);

/// Reads the `joint` of a drive; nullopt if absent. Pre: the drive's other keys have been read.
std::optional<JointLink> read_joint(TableReader& reader, const ServoConfig& servo,
                                    const Mechanism* body);

/// Rejects a joint that another drive already turns. `reader` is that of `servo`; `taken` marks the
/// joints of drives read before.
void check_joint(const TableReader& reader, const ServoConfig& servo, std::vector<bool>& taken);

}  // namespace lk::emulator

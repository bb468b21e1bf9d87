#pragma once

/// @file Readers for keys of a robot file: [body], `joint` of a drive, and [battery].

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

/// Reads the `joint` of a drive; nullopt if absent. Pre: `servo.profile` is that of the drive.
std::optional<JointLink> read_joint(TableReader& reader, const ServoConfig& servo,
                                    const Mechanism* body);

/// Rejects the joint of `servo` if another drive already turns it, else marks it in `taken`.
/// `reader` is that of the drive; `taken` is indexed as Mechanism::joints().
void check_joint(const TableReader& reader, const ServoConfig& servo, std::vector<bool>& taken);

}  // namespace lk::emulator

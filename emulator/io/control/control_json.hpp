#pragma once

/// JSON values of the control interface (docs/reference/control-api.md).

#include "emulator/files/json_table.hpp"
#include "emulator/io/live/line.hpp"
#include "emulator/io/live/world.hpp"

namespace lk::emulator {

class World;

Json bus_json(const Line& line);
Json drive_json(const Line& line, int id);
Json advice_json(const Line& line, const Advice& advice);
Json fault_json(const Line& line, const FaultReport& report);
Json fault_kinds_json();
Json signals_json(const World& world);
/// Scenarios shipped with lk-emu: name, file, subject.
Json scenarios_json();

}  // namespace lk::emulator

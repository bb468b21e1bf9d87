#pragma once

/// @file Keys of directives (docs/reference/events.md), used in configuration files, scenarios, the
/// control interface and the command line.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

class Bus;

/// Whether a directive needs a time, may have one, or is executed now.
enum class Timing : std::uint8_t { kRequired, kOptional, kNow };

/// Reads a table with one action for drives of `bus`: one directive per drive, or one for the whole
/// bus. Settings that are not given keep their value in the RAM of `running`, or, without it, of
/// the configuration. Throws ConfigError before anything is done.
std::vector<TimedDirective> read_directives(TableReader& reader, const BusConfig& bus,
                                            Timing timing, const Bus* running = nullptr);

/// Reads the condition `when`; `id` is its drive unless the condition names another.
std::optional<Condition> read_condition(TableReader& reader, const BusConfig& bus,
                                        std::optional<int> id);

/// Returns the drive of `bus`; null if there is none.
const ServoConfig* find_servo(const BusConfig& bus, int id);
/// Fails at `key` if `bus` has no such drive.
void check_id(const TableReader& reader, const std::string& key, const BusConfig& bus, int id);
/// Reads `id` or `ids`: the drives listed, ascending, or all of the bus.
std::vector<int> read_targets(TableReader& reader, const BusConfig& bus);

/// Returns true if the fault delays frames in the hosts' adapter.
bool delays_in_adapter(const FaultRow& row);
/// Rejects adapter_overrun on a bus without `adapter`, unless other faults delay frames there.
void check_adapter(const TableReader& event, const FaultRow& row, const BusConfig& bus,
                   bool others_delay);

/// Checks the value of `clear`: "all", "planned", or name or kind of a fault among `directives`.
/// Pre: these are all directives of a bus, ordered by time.
void check_clear(const TableReader& reader, const std::string& which,
                 const std::vector<TimedDirective>& directives);

/// Rejects `event`, the last one read, if the bus has no room: it would be dropped later.
void check_room(const TableReader& event, const std::vector<TimedDirective>& directives);

/// Reads a command byte, as a number or text: 0xA4 or "0xA4".
std::optional<std::uint8_t> read_command(TableReader& reader, const std::string& key);

/// Reads the name of an error bit.
std::optional<model::Error> read_error(TableReader& reader, const std::string& key);

/// Reads the name of a signal of `bus`: of a drive or the body.
const Signal* read_signal(TableReader& reader, const std::string& key, const BusConfig& bus);

/// Returns why a text does not fit into a line of a log or recording; empty if it does.
std::string text_problem(const std::string& text, std::size_t longest);

/// Reads seconds, up to kLongestTime.
std::optional<SimTime> read_duration(TableReader& reader, const std::string& key);

/// Reads every [[bus.event]] into `bus.events`: one directive per drive, ordered by time. Pre: the
/// bus has its drives.
void read_events(TableReader& reader, BusConfig& bus);

}  // namespace lk::emulator

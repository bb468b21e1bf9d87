#pragma once

/// @file The words of directives (docs/directives.md): the same in configuration files, scenarios,
/// the control interface and on the command line.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Whether a directive has to say when it is to be done, may say so, or must not: it is now.
enum class Timing : std::uint8_t { kRequired, kOptional, kNow };

/// Reads a table that holds one action for some drives of `bus`: one directive a drive, or one for
/// the bus as a whole. Throws ConfigError; nothing is done then.
std::vector<TimedDirective> read_directives(TableReader& reader, const BusConfig& bus,
                                            Timing timing);

/// Reads `when`, a condition; `id` is the drive that it is about unless it says another one.
std::optional<Condition> read_condition(TableReader& reader, const BusConfig& bus,
                                        std::optional<int> id);

/// Reads the table or the word `fault`, for the drives `ids`.
Fault read_fault(TableReader& reader, const BusConfig& bus, const std::vector<int>& ids);
/// The fault makes frames wait in the hosts' adapter.
bool delays_in_adapter(const FaultRow& row);
/// Refuses adapter_overrun on a bus without `adapter`, unless other faults delay frames in it.
void check_adapter(const TableReader& event, const FaultRow& row, const BusConfig& bus,
                   bool others_delay);

/// Refuses at `reader`, which holds `clear`, what is neither "all", "planned" nor the name or the
/// kind of a fault among `directives`, which are all of a bus in the order of their times.
void check_clear(const TableReader& reader, const std::string& which,
                 const std::vector<TimedDirective>& directives);

/// Refuses at `event`, the last that was read, what a bus has no room for: it would be forgotten on
/// the way.
void check_room(const TableReader& event, const std::vector<TimedDirective>& directives);

/// Reads the command byte that `key` gives, as a number or as text: 0xA4 or "0xA4".
std::optional<std::uint8_t> read_command(TableReader& reader, const std::string& key);

/// Reads an error bit by its word.
std::optional<model::Error> read_error(TableReader& reader, const std::string& key);

/// Reads the name of a signal of a drive of `bus`, or of its body.
const Signal* read_signal(TableReader& reader, const std::string& key, const BusConfig& bus);

/// Why a text of people cannot stand in a line of a log or a recording; empty when it can.
std::string text_problem(const std::string& text, std::size_t longest);

/// Seconds, up to kLongestTime.
std::optional<SimTime> read_duration(TableReader& reader, const std::string& key);

}  // namespace lk::emulator

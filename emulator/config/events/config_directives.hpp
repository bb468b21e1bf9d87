#pragma once

/// @file Readers for directives (docs/reference/events.md) in configuration files, scenarios, the
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

/// Reads a table with one action. Returns one directive for the whole bus, or one per drive and,
/// for `settings`, per setting. Parts of a setting that are not given are taken from the RAM of
/// `running`; if null, from the configuration. Throws ConfigError.
std::vector<TimedDirective> read_directives(TableReader& reader, const BusConfig& bus,
                                            Timing timing, const Bus* running = nullptr);

/// Reads the condition `when`; nullopt if absent. It observes drive `id` unless it names another.
std::optional<Condition> read_condition(TableReader& reader, const BusConfig& bus,
                                        std::optional<int> id);

/// Returns drive `id` of `bus`; null if there is none.
const ServoConfig* find_servo(const BusConfig& bus, int id);
/// Fails at `key` if `bus` has no drive `id`.
void check_id(const TableReader& reader, const std::string& key, const BusConfig& bus, int id);
/// Reads `id` or `ids`. Returns the listed drives, ascending; all drives of the bus if absent.
std::vector<int> read_targets(TableReader& reader, const BusConfig& bus);

/// Returns true if the fault delays frames in the hosts' adapter.
bool delays_in_adapter(const FaultRow& row);
/// Rejects adapter_overrun on a bus without `adapter`: the overrun needs delayed frames. Accepts it
/// if other faults delay frames (`others_delay`), or if it limits the frames of hosts.
void check_adapter(const TableReader& event, const Fault& fault, const BusConfig& bus,
                   bool others_delay);

/// Checks the value of `clear`: "all", "planned", or the name or kind of a fault in `directives`.
/// Pre: `directives` has all directives of a bus, ordered by time.
void check_clear(const TableReader& reader, const std::string& which,
                 const std::vector<TimedDirective>& directives);

/// Rejects `event`, which was read last, if `directives` exceeds what a bus can hold: the bus would
/// drop it later.
void check_room(const TableReader& event, const std::vector<TimedDirective>& directives);

/// Reads a command byte, as a number or text: 0xA4 or "0xA4".
std::optional<std::uint8_t> read_command(TableReader& reader, const std::string& key);

/// Reads the name of an error bit.
std::optional<model::Error> read_error(TableReader& reader, const std::string& key);

/// Reads the name of a signal of the drives or of the body of `bus`; null if absent.
const Signal* read_signal(TableReader& reader, const std::string& key, const BusConfig& bus);

/// Returns why a text does not fit into a line of a log or recording; empty if it does.
std::string text_problem(const std::string& text, std::size_t longest);

/// Reads seconds, up to kLongestTime.
std::optional<SimTime> read_duration(TableReader& reader, const std::string& key);

/// Reads every [[bus.event]] into `bus.events`, ordered by time. Pre: the drives of `bus` have been
/// read.
void read_events(TableReader& reader, BusConfig& bus);

}  // namespace lk::emulator

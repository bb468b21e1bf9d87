#include "emulator/io/program/answered_ids.hpp"

#include <fmt/format.h>
#include <net/if.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <system_error>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/io/program/config_listing.hpp"
#include "emulator/io/transports/netlink.hpp"
#include "emulator/io/transports/socketcan.hpp"

namespace lk::emulator {
namespace {

/// Returns a virtual CAN interface that is up; empty if none.
std::string vcan_that_is_up() {
  const std::unique_ptr<struct if_nameindex[], decltype(&::if_freenameindex)> all(
      ::if_nameindex(), ::if_freenameindex);
  for (const struct if_nameindex* one = all.get(); one != nullptr && one->if_name != nullptr;
       ++one) {
    try {
      const LinkState link = link_state(one->if_name);
      if (link.is_virtual() && link.up) return one->if_name;
    } catch (const std::system_error&) {
      return "";  // the kernel does not answer
    }
  }
  return "";
}

}  // namespace

std::string offer_without_can() {
  const auto all = bus_schemes();
  const auto scheme = std::ranges::find(all, Transport::kSlcanTcp, &BusScheme::transport);
  return "--bus " + std::string(scheme->example) + " --ids 1-4, " + std::string(scheme->hosts);
}

std::string bus_offer() {
  const std::string vcan = can_problem().empty() ? vcan_that_is_up() : "";
  if (!vcan.empty()) return "no bus: try --bus " + vcan + " --ids 1-4, or give --config FILE";
  return "no bus, and no vcan here: try " + offer_without_can() + "; or give --config FILE";
}

namespace {

/// Returns what a user can do instead of stopping the other program that answers at `id`.
std::string remedy(const ServoConfig& servo, int id, bool at_start) {
  if (servo.id == id) return "give other --ids";
  return at_start
             ? fmt::format("start with --wipe-rom: drive {} has this ID from its ROM", servo.id)
             : fmt::format(
                   "give drive {}, which uses this ID now, another ID: until then both answer",
                   servo.id);
}

AddressOf addresses_of(const Line& line) {
  return [&bus = line.bus()](const ServoConfig& servo) { return bus.bus_address(servo.id); };
}

}  // namespace

void AnsweredIds::take(const BusConfig& bus, const LinkState& link) {
  links_.emplace(bus.interface, link);
  for (const ServoConfig& servo : bus.servos) locks_.take(bus.interface, link, servo.id);
}

void AnsweredIds::start(const Line& line) {
  lock(line, Taken::kOrFail);
  log_changes(line);
}

void AnsweredIds::update(const Line& line) {
  lock(line, Taken::kOrWarn);
  log_changes(line);
}

void AnsweredIds::lock(const Line& line, Taken taken) {
  const auto& servos = line.config().servos;
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    const auto servo = std::ranges::find_if(
        servos, [&](const ServoConfig& one) { return line.bus().bus_address(one.id).id == id; });
    const Drive drive{line.name(), id};
    if (servo == servos.end()) {
      locks_.release(line.name(), id);
      shared_.erase(drive);
    } else if (!locks_.holds(line.name(), id)) {
      try {
        locks_.take(line.name(), links_.at(line.name()), id,
                    remedy(*servo, id, taken == Taken::kOrFail));
        shared_.erase(drive);
      } catch (const StartError& problem) {
        if (taken == Taken::kOrFail) throw;
        if (shared_.insert(drive).second) spdlog::warn("{}", problem.what());
      }
    }
  }
}

void AnsweredIds::log_changes(const Line& line) {
  for (const ServoConfig& servo : line.config().servos) {
    const std::string note = place_note(servo, line.config(), addresses_of(line));
    std::string& logged = logged_[{line.name(), servo.id}];
    if (note == logged) continue;
    logged = note;
    if (note.empty()) {
      spdlog::warn("{}: drive {} answers at its ID again", line.name(), servo.id);
    } else {
      spdlog::warn("{}: drive {} {}", line.name(), servo.id, note);
    }
  }
}

std::string moved_text(const Line& line) {
  std::string text;
  for (const ServoConfig& servo : line.config().servos) {
    const std::string note = place_note(servo, line.config(), addresses_of(line));
    if (note.empty()) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", servo.id, note);
  }
  return text.empty() ? "" : " (" + text + ")";
}

}  // namespace lk::emulator

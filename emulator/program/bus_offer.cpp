#include "emulator/program/bus_offer.hpp"

#include <net/if.h>

#include <algorithm>
#include <memory>
#include <system_error>

#include "emulator/config/bus_name.hpp"
#include "emulator/transports/netlink.hpp"
#include "emulator/transports/socketcan.hpp"

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

}  // namespace lk::emulator

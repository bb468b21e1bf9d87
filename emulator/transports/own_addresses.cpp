#include "emulator/transports/own_addresses.hpp"

#include <ifaddrs.h>
#include <netinet/in.h>

#include <cstring>
#include <memory>

namespace lk::emulator {

namespace ip = boost::asio::ip;

std::set<ip::address> addresses_of_this_machine() {
  std::set<ip::address> found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, ::freeifaddrs);
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr) continue;
    if (one->ifa_addr->sa_family == AF_INET) {
      sockaddr_in address{};
      std::memcpy(&address, one->ifa_addr, sizeof address);
      found.insert(ip::address_v4(ntohl(address.sin_addr.s_addr)));
    } else if (one->ifa_addr->sa_family == AF_INET6) {
      sockaddr_in6 address{};
      std::memcpy(&address, one->ifa_addr, sizeof address);
      ip::address_v6::bytes_type bytes;
      std::memcpy(bytes.data(), &address.sin6_addr, bytes.size());
      found.insert(ip::address_v6(bytes));  // without its scope
    }
  }
  return found;
}

ip::address without_scope(const ip::address& address) {
  return address.is_v6() ? ip::address(ip::address_v6(address.to_v6().to_bytes())) : address;
}

}  // namespace lk::emulator

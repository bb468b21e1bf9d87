#pragma once

#include <boost/asio/ip/address.hpp>
#include <set>

namespace lk::emulator {

/// Addresses of all interfaces, without scopes; empty if the system does not report them.
std::set<boost::asio::ip::address> addresses_of_this_machine();
/// Converts fe80::1%eth0 to fe80::1.
boost::asio::ip::address without_scope(const boost::asio::ip::address& address);

}  // namespace lk::emulator

#pragma once

#include <boost/asio/ip/address.hpp>
#include <set>

namespace lk::emulator {

/// Those of its interfaces, without scopes; none where the system does not tell.
std::set<boost::asio::ip::address> addresses_of_this_machine();
/// fe80::1 of fe80::1%eth0.
boost::asio::ip::address without_scope(const boost::asio::ip::address& address);

}  // namespace lk::emulator

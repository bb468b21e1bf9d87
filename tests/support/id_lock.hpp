#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstddef>
#include <cstring>
#include <string>

#include "emulator/files/durable_file.hpp"

namespace lk::test {

/// Makes a lock's socket by hand, as another program does that has the drive `id`.
inline emulator::Descriptor id_lock(const std::string& interface, int id) {
  const std::string name = "lk-emu/" + interface + "/" + std::to_string(id);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, name.data(), name.size());
  emulator::Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address),
                   static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size())),
            0);
  return socket;
}

}  // namespace lk::test

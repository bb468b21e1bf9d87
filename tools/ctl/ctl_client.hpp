#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

/// Client of a running lk-emu at its Unix socket; one connection for each request.
class CtlClient {
 public:
  explicit CtlClient(std::filesystem::path socket) : socket_(std::move(socket)) {}

  struct Answer {
    int status = 0;
    Json body;
  };
  /// Sends a request. The `path` is relative to the API's base: "/status". Waits at most
  /// `patience`; 0: no limit. Throws StartError if there is no answer.
  Answer ask(const std::string& method, const std::string& path, const Json& body = nullptr,
             std::chrono::seconds patience = {}) const;

 private:
  std::filesystem::path socket_;
};

/// Returns `socket` if given, else the only socket of a running lk-emu, or the only one with `bus`.
/// With `bus`, skips sockets that do not answer in time, with a message. Throws StartError.
std::filesystem::path find_socket(const std::string& socket, const std::string& bus);

}  // namespace lk::emulator

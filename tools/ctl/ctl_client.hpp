#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

/// Client for the Unix socket of a running lk-emu. Opens a connection for each request.
class CtlClient {
 public:
  explicit CtlClient(std::filesystem::path socket) : socket_(std::move(socket)) {}

  struct Answer {
    int status = 0;
    Json body;
  };
  /// Sends a request and returns the answer. `path` is relative to the base of the API: "/status".
  /// Waits at most `patience`; 0: no limit. Throws StartError without an answer.
  Answer ask(const std::string& method, const std::string& path, const Json& body = nullptr,
             std::chrono::seconds patience = {}) const;

 private:
  std::filesystem::path socket_;
};

/// Returns `socket` if not empty. Else returns the socket of the only running lk-emu, or with `bus`
/// of the only one that has this bus. With `bus`, prints a message about sockets that do not answer
/// in time, and skips them. Throws StartError.
std::filesystem::path find_socket(const std::string& socket, const std::string& bus);

}  // namespace lk::emulator

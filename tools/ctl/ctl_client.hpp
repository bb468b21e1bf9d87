#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

/// Asks a running lk-emu at its Unix socket: one connection for each question.
class CtlClient {
 public:
  explicit CtlClient(std::filesystem::path socket) : socket_(std::move(socket)) {}

  struct Answer {
    int status = 0;
    Json body;
  };
  /// `path` is below the API's base: "/status". Waits as long as the answer takes, or as long as
  /// `patience` is. Throws StartError when nobody answers.
  Answer ask(const std::string& method, const std::string& path, const Json& body = nullptr,
             std::chrono::seconds patience = {}) const;

 private:
  std::filesystem::path socket_;
};

/// The socket to ask at: `socket` if that is given, else the only one of a running lk-emu, or the
/// only one that has `bus`; one that does not answer soon is passed over, and told of. Throws
/// StartError.
std::filesystem::path find_socket(const std::string& socket, const std::string& bus);

}  // namespace lk::emulator

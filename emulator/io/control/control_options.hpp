#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace lk::emulator {

struct HttpAddress {
  std::string address;     // "127.0.0.1"; an IP address, not a name
  std::uint16_t port = 0;  // 0: any free port
};

/// Time-outs for clients.
struct Timeouts {
  std::chrono::milliseconds request = std::chrono::seconds(10);  // for a whole request
  std::chrono::milliseconds idle = std::chrono::seconds(60);     // between requests
};

/// Addresses and rights of the control interface.
struct ControlOptions {
  std::string socket;  // Unix socket path; empty: in the runtime directory; "none": no socket
  std::optional<HttpAddress> http;
  bool pages_may_write = false;      // web pages may write; if open_to_others, all clients
  std::string page_language;         // "en" or "zh"; empty: language of the browser
  std::filesystem::path token_file;  // token required over TCP; empty: none
  bool open_to_others = false;       // no token required on any address (--http-token none)
  Timeouts timeouts;
};

}  // namespace lk::emulator

#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace lk::emulator {

struct HttpAddress {
  std::string address;     // "127.0.0.1"; as numbers, not as a name
  std::uint16_t port = 0;  // 0: any
};

/// How long a client may take.
struct Patience {
  std::chrono::milliseconds request = std::chrono::seconds(10);  // for all of one, from its start
  std::chrono::milliseconds idle = std::chrono::seconds(60);     // between requests
};

/// Where the program lets itself be controlled.
struct ControlOptions {
  std::string socket;  // path of the Unix socket; empty: in the runtime directory; "none": nowhere
  std::optional<HttpAddress> http;
  bool pages_may_write = false;      // whatever has an Origin, and all who are let in by "none"
  std::string page_language;         // "en" or "zh"; empty: the browser knows
  std::filesystem::path token_file;  // what clients have to show over TCP; empty: nothing
  bool open_to_others = false;       // no token is wanted, on any address (--http-token none)
  Patience patience;
};

}  // namespace lk::emulator

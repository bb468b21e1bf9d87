#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

namespace lk::emulator {

/// Behaviour of the drives when their simulator stops, vanishes or sends invalid data.
enum class ShaftsLost : std::uint8_t {
  kFree,  // they keep running: shafts keep their last inertia, without external torque
  kStop,  // time stands still until a simulator connects
};

/// Address for simulators (--shafts).
struct ShaftOptions {
  std::string path = {};     // Unix socket path; empty: TCP
  std::string address = {};  // an IP address
  std::uint16_t port = 0;    // 0: any free port
  ShaftsLost lost = ShaftsLost::kFree;
};

/// Parses "unix:PATH" or "tcp:[ADDR:]PORT"; returns the error otherwise.
std::variant<ShaftOptions, std::string> parse_shafts_place(const std::string& text);
/// Parses "free" or "stop".
std::optional<ShaftsLost> parse_shafts_lost(const std::string& text);

}  // namespace lk::emulator

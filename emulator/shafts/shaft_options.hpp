#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

namespace lk::emulator {

/// What becomes of the drives when their simulator stops, vanishes or says what makes no sense.
enum class ShaftsLost : std::uint8_t {
  kFree,  // they go on: their shafts keep the inertia that they felt last, and nothing pushes them
  kStop,  // time stands until a simulator comes
};

/// Where simulators find the shafts of the drives (--shafts).
struct ShaftOptions {
  std::string path = {};     // of a Unix socket; empty: TCP
  std::string address = {};  // as numbers
  std::uint16_t port = 0;    // 0: any
  ShaftsLost lost = ShaftsLost::kFree;
};

/// "unix:PATH", "tcp:[ADDR:]PORT"; or why it is neither.
std::variant<ShaftOptions, std::string> parse_shafts_place(const std::string& text);
/// "free", "stop"
std::optional<ShaftsLost> parse_shafts_lost(const std::string& text);

}  // namespace lk::emulator

#pragma once

#include <optional>
#include <string_view>

namespace lk::emulator {

/// Limit for the parts of a key "a.b.c"; no file here needs more.
inline constexpr int kMostKeyParts = 32;

/// Returns the line (from 1) of the first key with more parts. The parser nests one table per part,
/// and their destruction would overflow the stack.
std::optional<int> line_of_deep_key(std::string_view toml);

}  // namespace lk::emulator

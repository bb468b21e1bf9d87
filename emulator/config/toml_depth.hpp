#pragma once

#include <optional>
#include <string_view>

namespace lk::emulator {

/// Parts that a key may have, "a.b.c": more than any file here needs.
inline constexpr int kMostKeyParts = 32;

/// The line of the first key that has more parts, from 1. The parser makes a table of each part, in
/// each other, and the stack of whoever takes those apart again ends somewhere.
std::optional<int> line_of_deep_key(std::string_view toml);

}  // namespace lk::emulator

#pragma once

/// @file Shared helpers of the harnesses.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

namespace lk::fuzz {

/// `line`: of the caller, for the analysis of a finding. (Clang 14 has no std::source_location.)
inline void require(bool condition, int line = __builtin_LINE()) {
  if (condition) return;
  std::fprintf(stderr, "line %d of the harness: does not hold\n", line);
  std::abort();
}

/// Reads the bytes of an input in order; after its end come zeros.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool empty() const { return at_ >= bytes_.size(); }
  std::uint8_t byte() { return empty() ? std::uint8_t{0} : bytes_[at_++]; }
  std::uint16_t word() {
    const unsigned low = byte();
    return static_cast<std::uint16_t>(low | static_cast<unsigned>(byte()) << 8U);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace lk::fuzz

#pragma once

#include <string>

#include "tools/decode/decoder.hpp"

namespace lk::emulator {

/// Objects for programs, each on a line of its own; the same in every language (docs/decode.md).
std::string frame_json(const DecodedFrame& frame);
std::string bad_line_json(std::uint64_t line, const std::string& problem);
/// Stamps are steps (-t d): from this line on, times are sums.
std::string steps_json(std::uint64_t line);
std::string summary_json(const DecodeSummary& summary, const DecodeOptions& options);

}  // namespace lk::emulator

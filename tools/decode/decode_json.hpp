#pragma once

#include <string>

#include "tools/decode/decoder.hpp"

namespace lk::emulator {

/// JSON objects, each on its own line; the same in every language (docs/reference/formats.md).
std::string frame_json(const DecodedFrame& frame);
std::string bad_line_json(std::uint64_t line, const std::string& problem);
/// Reports that time stamps are steps (-t d): from this line on, times are sums.
std::string steps_json(std::uint64_t line);
std::string summary_json(const DecodeSummary& summary, const DecodeOptions& options);

}  // namespace lk::emulator

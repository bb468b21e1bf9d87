#pragma once

#include <string>

#include "tools/decode/decoder.hpp"

namespace lk::emulator {

/// Text lines, each with its line end.
std::string frame_line(const DecodedFrame& frame, const DecodeOptions& options);
/// A note that is printed once: "# …".
std::string note_line(const BilingualText& words, const DecodeOptions& options);
/// Describes the assumed generation and motor; empty if both were given.
std::string assumption_line(const DecodeOptions& options, protocol::Framing framing);
std::string bad_line(std::uint64_t line, const std::string& problem, const DecodeOptions& options);
std::string summary_text(const DecodeSummary& summary, const DecodeOptions& options);

}  // namespace lk::emulator

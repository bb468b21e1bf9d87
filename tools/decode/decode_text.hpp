#pragma once

#include <string>

#include "tools/decode/decoder.hpp"

namespace lk::emulator {

/// Lines for people, each with its end.
std::string frame_line(const DecodedFrame& frame, const DecodeOptions& options);
/// A note, said once: "# …".
std::string note_line(const Words& words, const DecodeOptions& options);
/// What the numbers are read by, where nobody said it; empty: everything was said.
std::string assumption_line(const DecodeOptions& options, protocol::Framing framing);
std::string bad_line(std::uint64_t line, const std::string& problem, const DecodeOptions& options);
std::string summary_text(const DecodeSummary& summary, const DecodeOptions& options);

}  // namespace lk::emulator

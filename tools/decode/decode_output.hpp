#pragma once

#include <fmt/format.h>

#include <string>

#include "tools/decode/decoder.hpp"

namespace lk::emulator {

/// Formats `words` in the language, with the values at its placeholders.
template <class... Values>
std::string say(const BilingualText& words, Language language, const Values&... values) {
  return fmt::format(fmt::runtime(words.in(language)), values...);
}

// Return text lines, each with its line end.

std::string frame_line(const DecodedFrame& frame, const DecodeOptions& options);
/// Returns a note as a line that begins with "# ".
std::string note_line(const BilingualText& words, const DecodeOptions& options);
/// Describes the assumed generation and motor; empty if both were given.
std::string assumption_line(const DecodeOptions& options, protocol::Framing framing);
std::string bad_line(std::uint64_t line, const std::string& problem, const DecodeOptions& options);
std::string summary_text(const DecodeSummary& summary, const DecodeOptions& options);

// Return JSON objects, each on its own line; equal in all languages (docs/reference/formats.md).

std::string frame_json(const DecodedFrame& frame);
std::string bad_line_json(std::uint64_t line, const std::string& problem);
/// Reports that time stamps are differences (candump -t d), found at `line`. From there on, times
/// are sums of these differences.
std::string steps_json(std::uint64_t line);
std::string summary_json(const DecodeSummary& summary, const DecodeOptions& options);

}  // namespace lk::emulator

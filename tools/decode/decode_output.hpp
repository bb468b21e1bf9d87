#pragma once

#include <fmt/format.h>

#include <string>

#include "tools/decode/decoder.hpp"

namespace lk::emulator {

/// Formats the text of the language.
template <class... Values>
std::string say(const BilingualText& words, Language language, const Values&... values) {
  return fmt::format(fmt::runtime(words.in(language)), values...);
}

// Text lines, each with its line end.

std::string frame_line(const DecodedFrame& frame, const DecodeOptions& options);
/// A note that is printed once: "# …".
std::string note_line(const BilingualText& words, const DecodeOptions& options);
/// Describes the assumed generation and motor; empty if both were given.
std::string assumption_line(const DecodeOptions& options, protocol::Framing framing);
std::string bad_line(std::uint64_t line, const std::string& problem, const DecodeOptions& options);
std::string summary_text(const DecodeSummary& summary, const DecodeOptions& options);

// JSON objects, each on its own line; the same in every language (docs/reference/formats.md).

std::string frame_json(const DecodedFrame& frame);
std::string bad_line_json(std::uint64_t line, const std::string& problem);
/// Reports that time stamps are steps (-t d): from this line on, times are sums.
std::string steps_json(std::uint64_t line);
std::string summary_json(const DecodeSummary& summary, const DecodeOptions& options);

}  // namespace lk::emulator

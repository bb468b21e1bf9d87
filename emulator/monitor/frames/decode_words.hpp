#pragma once

/// @file Texts of `lk-emu decode` in both languages, with the names of LK-TECH's manuals.

#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/language.hpp"
#include "emulator/monitor/frames/conversation.hpp"

namespace lk::emulator {

/// Translates a name, reason or error; returns `english` itself if it has no translation.
std::string_view in_language(std::string_view english, Language language);

/// Returns the values of a frame: "temperature 25 °C, iq 0.03 A". `asked`: code of the query; it
/// determines the unit of the slots of a command for several drives.
std::string quantities_text(const std::vector<ReplyValue>& quantities, std::uint32_t asked,
                            Language language);

/// Returns the topics of a Linux error frame by its identifier: "bus-off".
std::vector<std::string_view> error_frame_words(std::uint32_t classes);

/// Returns the words as a list in the language.
std::string listed(const std::vector<std::string_view>& words, Language language);

/// Formats with at most three decimals.
std::string three_decimals(double value);

/// Returns the number of terminal columns; Chinese characters take two.
std::size_t display_width(std::string_view text);
/// Return the text filled up with spaces to `width` columns: `padded` after it, `right` before it.
std::string padded(std::string_view text, std::size_t width);
std::string right(std::string_view text, std::size_t width);

}  // namespace lk::emulator

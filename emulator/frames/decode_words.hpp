#pragma once

/// @file What `lk-emu decode` says to people, in both languages, by the names of LK-TECH's manuals.

#include <string>
#include <string_view>
#include <vector>

#include "emulator/frames/conversation.hpp"
#include "emulator/ground/language.hpp"

namespace lk::emulator {

/// A name, a reason or an error in the language; itself where there is no word for it.
std::string_view in_language(std::string_view english, Language language);

/// "temperature 25 °C, iq 0.03 A": what a frame says. `asked` tells what the slots of a command for
/// several drives are.
std::string quantities_text(const std::vector<ReplyValue>& quantities, std::uint32_t asked,
                            Language language);

/// What an error frame of Linux is about, from its identifier: "bus-off".
std::vector<std::string_view> error_frame_words(std::uint32_t classes);

/// Words in a row, in the language.
std::string listed(const std::vector<std::string_view>& words, Language language);

/// A number with at most three decimals.
std::string three_decimals(double value);

/// Columns that a terminal needs for it: Chinese characters take two.
std::size_t display_width(std::string_view text);
/// With spaces behind it, or before it, up to a width.
std::string padded(std::string_view text, std::size_t width);
std::string right(std::string_view text, std::size_t width);

}  // namespace lk::emulator

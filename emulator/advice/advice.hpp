#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "emulator/advice/kinds.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/command_info.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Mistake that a watcher has recognised: its kind, and its numbers in words.
struct Finding {
  AdviceKind kind;
  const Words* what;  // {1}, {2}, {3}: the numbers; {command} and others: the command
  std::array<double, 3> numbers{};
  bool renews = false;                                 // later numbers replace the first
  const Words* todo = nullptr;                         // null: text of the kind
  std::optional<std::uint8_t> command = std::nullopt;  // the command concerned
};
/// Returns true if drives of this generation have the command, in a series that supports it.
bool has(const protocol::GenerationRow& row, const protocol::CommandInfo& command,
         protocol::Framing framing);
/// Returns true if both findings are repetitions of one mistake.
bool same_cause(const Finding& one, const Finding& other);

/// A mistake of a host with a drive, and how often it was made.
struct Advice {
  Finding found;  // of the first time; for a rate, of the last
  int id = 0;     // the drive; 0: the whole bus
  std::uint64_t count = 0;
  SimTime first{0};
  protocol::Frame frame;  // first frame with the mistake
};

/// Returns the problem with the frame, numbers filled in.
std::string what_text(const Advice& advice, Language language);
/// Returns the remedy.
std::string todo_text(const Advice& advice, Language language);
/// Returns one line: "vcan0:1: rom-wear: … (12 times, first 141#32… at 0.25 s); todo".
std::string advice_line(const std::string& bus, const Advice& advice, Language language);

}  // namespace lk::emulator

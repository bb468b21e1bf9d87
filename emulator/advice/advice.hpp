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

/// What a watcher has recognised in a frame: which kind, and its numbers in words.
struct Finding {
  AdviceKind kind;
  const Words* what;  // {1}, {2}, {3} stand for the numbers; {command} and others for the command
  std::array<double, 3> numbers{};
  bool renews = false;  // the numbers of the last one are to be told, not those of the first
  const Words* todo = nullptr;                         // null: that of the kind
  std::optional<std::uint8_t> command = std::nullopt;  // what it is about
};
/// Drives of the generation have the command on the wire, those of a series that knows it.
bool has(const protocol::GenerationRow& row, const protocol::CommandInfo& command,
         protocol::Framing framing);
/// One mistake, that may have been made several times.
bool same_cause(const Finding& one, const Finding& other);

/// A mistake that a host has made with a drive, so many times.
struct Advice {
  Finding found;  // the first time; where it is a rate, the last
  int id = 0;     // the drive; 0: the bus as a whole
  std::uint64_t count = 0;
  SimTime first{0};
  protocol::Frame frame;  // the first one
};

/// What is wrong with the frame, the numbers in it.
std::string what_text(const Advice& advice, Language language);
/// What is to be done about it.
std::string todo_text(const Advice& advice, Language language);
/// "vcan0:1: rom-wear: … (12 times, first 141#32… at 0.25 s); todo": one line.
std::string advice_line(const std::string& bus, const Advice& advice, Language language);

}  // namespace lk::emulator

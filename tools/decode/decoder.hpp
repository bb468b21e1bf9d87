#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/language.hpp"
#include "emulator/monitor/frames/candump_text.hpp"
#include "tools/decode/summary.hpp"

namespace lk::emulator {

/// Options for decoding and for the output.
struct DecodeOptions {
  Generation generation = Generation::kLegacy;
  Profile profile;  // of the motor
  bool generation_given = false;
  bool motor_given = false;
  bool json = false;
  bool colour = false;
  Language language = Language::kEnglish;
  std::vector<BusConfig> buses;  // of a recording, which has its drives; empty: of a log
};

/// A frame and its meaning.
struct DecodedFrame {
  std::uint64_t line = 0;  // from 1
  std::string_view interface;
  protocol::Frame frame;
  std::optional<SimTime> at;       // time stamp of the log
  std::optional<SimTime> since{};  // time since the first frame
  FrameInfo info{};
  FrameWords words{};
};

/// Summary of a log. Its memory is bounded.
struct DecodeSummary {
  std::map<std::string, BusTally, std::less<>> buses;
  std::uint64_t frames = 0;
  std::uint64_t bad_lines = 0;   // lines that are not frames
  bool steps = false;            // time stamps are steps (-t d)
  std::uint64_t odd_states = 0;  // replies to 0x9A and 0x9B that do not look like the generation
};

/// Converts lines of candump to text or JSON.
class Decoder {
 public:
  explicit Decoder(DecodeOptions options);

  /// Returns the output for a line without its end.
  std::string take(std::string_view line);
  /// Ends the input and returns the summary.
  std::string finish();

  const DecodeSummary& summary() const { return summary_; }
  std::uint64_t frames() const { return summary_.frames; }
  std::uint64_t bad_lines() const { return summary_.bad_lines; }
  const std::string& first_problem() const { return first_problem_; }

 private:
  /// Bounds the memory; more than any machine has.
  static constexpr std::size_t kMaxInterfaces = 32;

  std::string refuse(const std::string& problem);
  std::string notes(const PrintedFrame& shown);
  std::string steps_found();
  static FrameWords read(const FrameInfo& info, const FrameReader& reader);
  std::string check_generation(const FrameInfo& info);

  /// One reader.
  std::span<const FrameReader> readers_of(std::string_view interface,
                                          protocol::Framing framing) const;

  DecodeOptions options_;
  std::array<FrameReader, 2> readers_;                               // by Framing
  std::map<std::string, FrameReader, std::less<>> recorded_drives_;  // by interface
  StampReader stamps_;
  std::map<std::pair<std::string, protocol::Framing>, Conversation> conversations_;
  DecodeSummary summary_;
  std::string first_problem_;
  std::uint64_t lines_ = 0;
  std::optional<SimTime> first_at_;
  bool noted_assumptions_ = false;
  bool noted_no_stamps_ = false;
};

}  // namespace lk::emulator

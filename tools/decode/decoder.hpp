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

/// Options of the decoder and its output.
struct DecodeOptions {
  Generation generation = Generation::kLegacy;
  Profile profile;  // motor profile
  bool generation_given = false;
  bool motor_given = false;
  bool json = false;
  bool colour = false;
  Language language = Language::kEnglish;
  std::vector<BusConfig> buses;  // drives, if the input is a recording; empty: it is a log
};

/// A frame of the input and its meaning.
struct DecodedFrame {
  std::uint64_t line = 0;  // from 1
  std::string_view interface;
  protocol::Frame frame;
  std::optional<SimTime> at;       // time stamp of the log
  std::optional<SimTime> since{};  // time since the first frame
  FrameInfo info{};
  FrameWords words{};
};

/// Summary of a log. Uses bounded memory.
struct DecodeSummary {
  std::map<std::string, BusTally, std::less<>> buses;
  std::uint64_t frames = 0;
  std::uint64_t bad_lines = 0;   // lines that are not frames
  bool steps = false;            // time stamps are differences (candump -t d)
  std::uint64_t odd_states = 0;  // replies to 0x9A, 0x9B without the layout of the generation
};

/// Converts lines of candump to text or JSON.
class Decoder {
 public:
  explicit Decoder(DecodeOptions options);

  /// Decodes a line without its line end. Returns the output for this line.
  std::string take(std::string_view line);
  /// Ends the input and returns the summary.
  std::string finish();

  const DecodeSummary& summary() const { return summary_; }
  std::uint64_t frames() const { return summary_.frames; }
  std::uint64_t bad_lines() const { return summary_.bad_lines; }
  const std::string& first_problem() const { return first_problem_; }

 private:
  /// Limit that bounds the memory; more interfaces than any machine has.
  static constexpr std::size_t kMaxInterfaces = 32;

  std::string refuse(const std::string& problem);
  std::string notes(const PrintedFrame& shown);
  std::string steps_found();
  static FrameWords read(const FrameInfo& info, const FrameReader& reader);
  std::string check_generation(const FrameInfo& info);

  /// Returns the reader for frames of this interface and framing, as a span of one element.
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

#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "emulator/advice/advice.hpp"

namespace lk::emulator {

/// A frame that is wrong, or may turn out to be.
struct Suspect {
  std::uint64_t number = 0;  // of the frame; 0: none
  SimTime at{0};
  protocol::Frame frame;
};

/// List of findings, one for each cause and drive, and marks for the last wrong frames.
class GivenList {
 public:
  /// Limits for a bus, and for one kind and drive. Findings beyond are only counted.
  static constexpr std::size_t kMost = 1000;
  static constexpr std::size_t kMostCauses = 16;  // assumed: a host with more scans
  static constexpr std::size_t kMarks = 1024;

  GivenList() : marks_(kMarks) {}
  void note(int id, const Finding& finding, const Suspect& suspect, std::uint64_t times = 1);
  const std::vector<Advice>& all() const { return all_; }
  std::string_view mark_of(std::uint64_t number) const;
  /// Number of findings without an entry.
  std::uint64_t left_out() const { return left_out_; }

 private:
  bool has_room(int id, AdviceKind kind) const;

  struct Mark {
    std::uint64_t number = 0;
    AdviceKind kind = AdviceKind::kRomWear;
  };
  std::vector<Advice> all_;
  std::uint64_t left_out_ = 0;
  std::vector<Mark> marks_;  // ring of the last kMarks, by number
};

}  // namespace lk::emulator

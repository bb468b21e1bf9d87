#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "emulator/advice/advice.hpp"

namespace lk::emulator {

/// A frame that is, or may turn out to be, wrong.
struct Suspect {
  std::uint64_t number = 0;  // of the frames heard; 0: none
  SimTime at{0};
  protocol::Frame frame;
};

/// What was found, once for each cause and drive, and the last frames that it was found in.
class GivenList {
 public:
  /// Entries of a bus; and of one kind and drive. More are counted.
  static constexpr std::size_t kMost = 1000;
  static constexpr std::size_t kMostCauses = 16;  // assumed: who makes more of them scans
  static constexpr std::size_t kMarks = 1024;

  GivenList() : marks_(kMarks) {}
  void note(int id, const Finding& finding, const Suspect& suspect, std::uint64_t times = 1);
  const std::vector<Advice>& all() const { return all_; }
  std::string_view mark_of(std::uint64_t number) const;
  /// How often something was found that has no entry.
  std::uint64_t left_out() const { return left_out_; }

 private:
  bool has_room(int id, AdviceKind kind) const;

  struct Mark {
    std::uint64_t number = 0;
    AdviceKind kind = AdviceKind::kRomWear;
  };
  std::vector<Advice> all_;
  std::uint64_t left_out_ = 0;
  std::vector<Mark> marks_;  // by number, the last kMarks
};

}  // namespace lk::emulator

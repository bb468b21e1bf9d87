#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"
#include "protocol/wire_format.hpp"
#include "tools/guess/product_info.hpp"
#include "tools/guess/traits.hpp"

namespace lk::emulator {

/// A frame as it was on the bus; `at` if the log says so.
struct Sighting {
  protocol::Frame frame;
  std::optional<SimTime> at;
};

/// How much one observation says. kSure: alone enough. kLikely: it takes two. kHint: nothing by
/// itself, but it makes silence doubtful. kSilence: a query without a reply, where the drive
/// answered others before and after.
enum class Weight : std::uint8_t { kSure, kLikely, kHint, kSilence };

/// Frames that leave the same values open.
struct Frames {
  std::uint64_t sure = 0;
  std::uint64_t likely = 0;
  std::uint64_t hints = 0;
  std::uint64_t silent = 0;
  std::vector<Sighting> first;  // the first of them

  std::uint64_t count() const { return sure + likely + silent; }
};

/// What was seen of one drive. Its size does not grow with time.
class Evidence {
 public:
  static constexpr std::size_t kMostExamples = 2;

  /// What was seen allows these values of the trait and no others. All or none of them: it says
  /// nothing.
  void see(Trait trait, ValueSet allowed, Weight weight, const Sighting& sighting);
  /// The same of what was seen before it was known what it says.
  void see(Trait trait, ValueSet allowed, const Frames& frames);
  /// It was on RS-485.
  void on_serial() { framing_ = protocol::Framing::kSerial; }
  protocol::Framing framing() const { return framing_; }
  /// The drive said what it is.
  void call_itself(const ProductInfo& product) { product_ = product; }
  const std::optional<ProductInfo>& product() const { return product_; }
  /// Of the commands that every drive answers.
  void count_answer(bool answered) { ++(answered ? answered_ : lost_); }

  /// The values that what was seen leaves open: all of them where nothing was seen that tells, none
  /// where frames contradict each other.
  ValueSet open(Trait trait) const;
  bool decided(Trait trait) const;
  /// Where what was seen leaves the value open, or not, and excludes others: frames for and
  /// against.
  std::uint64_t frames_for(Trait trait, std::size_t value) const;
  std::uint64_t frames_against(Trait trait, std::size_t value) const;
  /// Of the frames for it, the ones that leave the fewest values open first.
  std::vector<Sighting> examples(Trait trait, std::size_t value) const;

 private:
  using BySet = std::array<Frames, 1U << kMostValues>;
  bool excluded(Trait trait, std::size_t value) const;
  std::uint64_t enough_silence() const;

  std::map<Trait, BySet> seen_;
  protocol::Framing framing_ = protocol::Framing::kCan;
  std::optional<ProductInfo> product_;
  std::uint64_t answered_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace lk::emulator

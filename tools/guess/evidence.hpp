#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"
#include "protocol/wire_format.hpp"
#include "tools/guess/traits.hpp"

namespace lk::emulator {

/// Names and version in the reply to 0x12 (docs/reference/rs485.md). Safe to print.
struct ProductInfo {
  std::string driver;    // "DS40R7"
  std::string motor;     // "MS4015"
  std::string firmware;  // "2.35"
};

/// Returns the product info of a reply to 0x12; empty for other packets.
std::optional<ProductInfo> product_info(const protocol::Frame& reply);

/// A frame as on the bus. `at` is its time, empty if the log has no time stamps.
struct Sighting {
  protocol::Frame frame;
  std::optional<SimTime> at;
};

/// Weight of one observation. kSure: one frame decides. kLikely: two frames decide. kHint: decides
/// nothing, but makes conclusions from silence doubtful. kSilence: a query got no reply from a
/// drive that answered other queries before and after.
enum class Weight : std::uint8_t { kSure, kLikely, kHint, kSilence };

/// Number of frames that allow the same values of a trait, by weight.
struct Frames {
  std::uint64_t sure = 0;
  std::uint64_t likely = 0;
  std::uint64_t hints = 0;
  std::uint64_t silent = 0;
  std::vector<Sighting> first;  // examples

  std::uint64_t count() const { return sure + likely + silent; }
};

/// Evidence about one drive. Uses bounded memory.
class Evidence {
 public:
  static constexpr std::size_t kMaxExamples = 2;

  /// Adds a frame that allows only these values of the trait. Ignores sets of all or no values.
  void see(Trait trait, ValueSet allowed, Weight weight, const Sighting& sighting);
  /// Adds frames that were counted before their meaning was known.
  void see(Trait trait, ValueSet allowed, const Frames& frames);
  /// Notes that the drive is on RS-485.
  void on_serial() { framing_ = protocol::Framing::kSerial; }
  protocol::Framing framing() const { return framing_; }
  /// Notes the product info of the drive.
  void set_product(const ProductInfo& product) { product_ = product; }
  const std::optional<ProductInfo>& product() const { return product_; }
  /// Counts a query that every drive answers, for the rate of lost frames.
  void count_answer(bool answered) { ++(answered ? answered_ : lost_); }

  /// Returns the possible values: all without evidence, none if frames contradict each other.
  ValueSet open(Trait trait) const;
  bool decided(Trait trait) const;
  /// Return the number of frames that allow, or exclude, the value.
  std::uint64_t frames_for(Trait trait, std::size_t value) const {
    return count(trait, value, true);
  }
  std::uint64_t frames_against(Trait trait, std::size_t value) const {
    return count(trait, value, false);
  }
  /// Returns examples of frames that allow the value, the most specific ones first.
  std::vector<Sighting> examples(Trait trait, std::size_t value) const;

 private:
  using BySet = std::array<Frames, 1U << kMaxValues>;
  std::uint64_t count(Trait trait, std::size_t value, bool allowed) const;
  bool excluded(Trait trait, std::size_t value) const;
  std::uint64_t enough_silence() const;

  std::map<Trait, BySet> seen_;
  protocol::Framing framing_ = protocol::Framing::kCan;
  std::optional<ProductInfo> product_;
  std::uint64_t answered_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace lk::emulator

#include "tools/guess/evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "protocol/serial_commands.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kNameBytes = 20;
constexpr std::uint8_t kOldBytes = 42;  // in the oldest manual
constexpr std::uint8_t kBytes = 58;

std::string name_at(const protocol::Payload& data, std::size_t at) {
  std::string name;
  for (std::size_t n = at; n < at + kNameBytes && data[n] != 0; ++n) {
    name += data[n] >= 0x20 && data[n] <= 0x7E ? static_cast<char>(data[n]) : '?';
  }
  return name;
}

}  // namespace

std::optional<ProductInfo> product_info(const protocol::Frame& reply) {
  const auto& data = reply.data;
  if (reply.kind != protocol::FrameKind::kSerial) return std::nullopt;
  if (data[0] != static_cast<std::uint8_t>(protocol::ReadProduct::kOpcode)) return std::nullopt;
  ProductInfo info{name_at(data, 1), name_at(data, 1 + kNameBytes), ""};
  if (reply.dlc == 1 + kBytes) {
    info.firmware =
        fmt::format("{:.2f}", protocol::get_le<std::uint16_t>(data, kBytes - 1) / 100.0);
  } else if (reply.dlc == 1 + kOldBytes) {
    info.firmware = fmt::format("{:.1f}", data[kOldBytes] / 10.0);
  } else {
    return std::nullopt;
  }
  return info;
}

namespace {

/// Frames against a value count only if they are more than one in this many of all sure and likely
/// frames (assumed). A log in which a drive was replaced has frames for and against a value.
constexpr std::uint64_t kContradictionDivisor = 20;
/// Unanswered queries needed for each query that may have been answered (assumed).
constexpr std::uint64_t kSilencePerHint = 4;
/// Prior of the loss rate: as if, before the log, one of this many queries had been lost (assumed).
constexpr double kBefore = 20;
/// Largest probability that lost frames explain all the unanswered queries (assumed).
constexpr double kLargestLossProbability = 1.0 / 400;

void add(Frames& to, const Frames& more) {
  to.sure += more.sure;
  to.likely += more.likely;
  to.hints += more.hints;
  to.silent += more.silent;
  for (const Sighting& one : more.first) {
    if (to.first.size() < Evidence::kMaxExamples) to.first.push_back(one);
  }
}

}  // namespace

void Evidence::see(Trait trait, ValueSet allowed, Weight weight, const Sighting& sighting) {
  Frames one;
  std::uint64_t* const counters[] = {&one.sure, &one.likely, &one.hints, &one.silent};
  *counters[static_cast<std::size_t>(weight)] = 1;
  if (weight != Weight::kHint) one.first.push_back(sighting);
  see(trait, allowed, one);
}

void Evidence::see(Trait trait, ValueSet allowed, const Frames& frames) {
  if (allowed == 0 || allowed == all_of(trait)) return;
  add(seen_[trait].at(allowed), frames);
}

ValueSet Evidence::open(Trait trait) const {
  ValueSet values = 0;
  for (std::size_t value = 0; value < row_of(trait).count; ++value) {
    if (!excluded(trait, value)) values |= only(value);
  }
  return values;
}

bool Evidence::decided(Trait trait) const { return std::has_single_bit(open(trait)); }

/// Returns how many unanswered queries are needed so that lost frames do not explain them. At least
/// two; more if replies to commands that every drive answers are missing too.
std::uint64_t Evidence::enough_silence() const {
  const double loss = (static_cast<double>(lost_) + 1) /
                      (static_cast<double>(answered_) + static_cast<double>(lost_) + kBefore);
  std::uint64_t enough = 1;
  for (double all = loss; all > kLargestLossProbability && enough < 1000; all *= loss) ++enough;
  return std::max<std::uint64_t>(enough, 2);
}

bool Evidence::excluded(Trait trait, std::size_t value) const {
  const auto found = seen_.find(trait);
  if (found == seen_.end()) return false;
  Frames all, against;
  for (std::size_t set = 1; set < found->second.size(); ++set) {
    const Frames& frames = found->second.at(set);
    add(all, frames);
    if (!contains(static_cast<ValueSet>(set), value)) add(against, frames);
  }
  const auto tell = [](const Frames& frames) { return frames.sure > 0 || frames.likely > 1; };
  // One sure reply outweighs any silence. A likely reply does not: it may be a query that the host
  // repeats after about the latency of the drive.
  const std::uint64_t doubtful = all.hints + all.likely;
  const bool silence =
      all.sure == 0 && all.silent >= enough_silence() && all.silent > kSilencePerHint * doubtful;
  if (silence || !tell(all)) return silence && against.silent > 0;
  return tell(against) &&
         (against.sure + against.likely) * kContradictionDivisor > all.sure + all.likely;
}

std::uint64_t Evidence::count(Trait trait, std::size_t value, bool allowed) const {
  const auto found = seen_.find(trait);
  if (found == seen_.end()) return 0;
  std::uint64_t count = 0;
  for (std::size_t set = 1; set < found->second.size(); ++set) {
    if (contains(static_cast<ValueSet>(set), value) == allowed) {
      count += found->second.at(set).count();
    }
  }
  return count;
}

std::vector<Sighting> Evidence::examples(Trait trait, std::size_t value) const {
  const auto found = seen_.find(trait);
  std::vector<Sighting> some;
  for (int wanted = 1; found != seen_.end() && wanted < static_cast<int>(kMaxValues); ++wanted) {
    for (std::size_t set = 1; set < found->second.size(); ++set) {
      if (std::popcount(set) != wanted || !contains(static_cast<ValueSet>(set), value)) continue;
      const auto& first = found->second.at(set).first;
      some.insert(some.end(), first.begin(), first.end());
    }
  }
  some.resize(std::min(some.size(), kMaxExamples));
  return some;
}

}  // namespace lk::emulator

#pragma once

#include <compare>
#include <cstdint>
#include <vector>

#include "tools/campaign/results/sqlite.hpp"

namespace lk::emulator {

/// The cases whose number, divided by `of`, leaves `index`: from 0 to `of` - 1. A whole campaign is
/// 0 of 1.
struct Shard {
  std::uint64_t index = 0;
  std::uint64_t of = 1;
  friend auto operator<=>(const Shard&, const Shard&) = default;
};
inline constexpr std::uint64_t kMostShards = 1'000'000;

/// Throws std::invalid_argument when there is no such shard.
void write_shard(const Database& database, Shard shard);
/// Sorted. Throws StartError.
std::vector<Shard> read_shards(const Database& database);

}  // namespace lk::emulator

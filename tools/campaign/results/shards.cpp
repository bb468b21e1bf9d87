#include "tools/campaign/results/shards.hpp"

#include <algorithm>
#include <stdexcept>

namespace lk::emulator {

void write_shard(const Database& database, Shard shard) {
  if (shard.index >= shard.of || shard.of > kMostShards) throw std::invalid_argument("no shard");
  Statement row(database, "INSERT OR IGNORE INTO shards VALUES (?, ?)");
  row.bind(static_cast<std::int64_t>(shard.index)).bind(static_cast<std::int64_t>(shard.of)).run();
}

std::vector<Shard> read_shards(const Database& database) {
  std::vector<Shard> shards;
  Statement row(database, "SELECT shard, shards FROM shards");
  while (row.step()) {
    const std::int64_t index = row.integer(0, kMostShards - 1);
    const std::int64_t of = row.integer(index + 1, kMostShards);
    shards.push_back({static_cast<std::uint64_t>(index), static_cast<std::uint64_t>(of)});
  }
  std::ranges::sort(shards);
  return shards;
}

}  // namespace lk::emulator

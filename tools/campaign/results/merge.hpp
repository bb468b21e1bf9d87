#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tools/campaign/results/campaign_store.hpp"

namespace lk::emulator {

/// What a merge has put together.
struct MergeSummary {
  std::uint64_t cases = 0;     // that are there
  std::uint64_t of = 0;        // as the head says
  std::uint64_t lacks = 0;     // cases
  std::vector<Shard> missing;  // shards of which no part is
  bool is_whole = false;       // or on its way, of `adaptive`, whose shards need those before
  /// "9000 of 10000 cases; missing: shard 3/10", "9990 of 10000 cases; missing: 10 of shards that
  /// were interrupted"
  std::string text() const;
};

/// Parts of one campaign (shards, or merges of some of them) as one file, in one pass and bounded
/// memory. `out` appears when it is complete. Throws StartError, of one line, when a part is of
/// another version, plan or input than the first, is in use or damaged, or has another result of
/// the same case; when `out` is there already; and when there are more parts than this process may
/// have files open: then merge some of them first.
MergeSummary merge_campaigns(const std::filesystem::path& out,
                             std::span<const std::filesystem::path> parts);

}  // namespace lk::emulator

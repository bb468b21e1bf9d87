#pragma once

/// @file Where the results of a campaign are: one SQLite file
/// (docs/decisions/0030-results-in-sqlite.md).

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tools/campaign/results/case_result.hpp"
#include "tools/campaign/results/shards.hpp"

namespace lk::emulator {

class CaseCursor;

/// The file of a campaign, or of one of its shards. Whoever has it to write has it alone: others,
/// readers too, are refused until it is closed. Readers keep writers out. All errors are a
/// StartError of one line that begins with the path: what is damaged, foreign, in use, full. For
/// one thread at a time.
class CampaignStore {
 public:
  /// A new one, to write. A file of this name is there with all of `head` or not at all. Throws
  /// StartError when there is one already, and leaves it as it is.
  static CampaignStore create(const std::filesystem::path& path, const CampaignHead& head);
  /// One that is there, to go on. Throws StartError that says which when it is of another version,
  /// plan or input.
  static CampaignStore resume(const std::filesystem::path& path, const CampaignHead& head);
  /// One that is there, to read. Where a killed process left something half done, that is undone
  /// first, which takes the right to write. Throws StartError when it is no campaign.
  static CampaignStore read(const std::filesystem::path& path);

  CampaignStore(CampaignStore&&) noexcept;
  CampaignStore& operator=(CampaignStore&&) noexcept;
  ~CampaignStore();

  const CampaignHead& head() const;
  const std::filesystem::path& path() const;

  /// All of them or none; after it returns, neither SIGKILL nor a power cut loses one. About 10 ms
  /// on a disk: give it many. A case that is there already must be the same but for its wall clock.
  /// Values are as the dimension's head says: a number (not NaN) where it has no words, else a
  /// word. Numbers are below head().numbers, times not negative; wall_s is kept to the microsecond.
  /// Throws std::invalid_argument when they are not.
  void put(std::span<const CaseResult> results);
  bool has(std::uint64_t number) const;  // finished
  std::uint64_t count() const;
  std::optional<CaseResult> find(std::uint64_t number) const;
  /// All in ascending order of their numbers, one at a time in memory (case_rows.hpp).
  CaseCursor cursor() const;
  void for_each(const std::function<void(const CaseResult&)>& take) const;

  /// Which shard this file is, so that a merge can say which ones are missing. Once or often.
  /// Throws std::invalid_argument when there is no such shard, or more than kMostShards.
  void note_shard(Shard shard);
  /// Those it was noted to be, or was merged from; sorted.
  std::vector<Shard> shards() const;

 private:
  struct File;
  explicit CampaignStore(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

}  // namespace lk::emulator

#include "tools/campaign/results/merge.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <queue>
#include <set>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/campaign/results/canonical.hpp"
#include "tools/campaign/results/case_rows.hpp"
#include "tools/campaign/results/new_file.hpp"
#include "tools/campaign/results/same_campaign.hpp"
#include "tools/campaign/results/schema.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

namespace {

/// So many files that are missing are named.
constexpr std::size_t kNamed = 10;

/// A file that is read from its beginning to its end.
struct Part {
  explicit Part(const fs::path& path) : store(CampaignStore::read(path)), cases(store.cursor()) {
    next();
  }
  void next() { at = cases.next(); }

  CampaignStore store;
  CaseCursor cases;
  const CaseResult* at = nullptr;
};
using Parts = std::vector<std::unique_ptr<Part>>;

/// All of them are open at a time, each with its file.
void allow_many_files() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

Parts open_parts(std::span<const fs::path> paths) {
  allow_many_files();
  Parts parts;
  for (const auto& path : paths) {
    parts.push_back(std::make_unique<Part>(path));
    const auto& first = parts.front()->store;
    if (const auto other = difference(parts.back()->store.head(), first.head())) {
      throw StartError(on_one_line(path.string()) + ": " + *other + " as " +
                       on_one_line(first.path().string()) + " is");
    }
  }
  return parts;
}

/// The part with the lowest number is on top; of several, the one that was given first.
class ByNumber {
 public:
  explicit ByNumber(Parts& parts) : parts_(parts) {
    for (std::size_t i = 0; i < parts_.size(); ++i) add(i);
  }
  /// Null: there are no more. Stands until `next`.
  Part* top() { return waiting_.empty() ? nullptr : parts_[waiting_.top().second].get(); }
  void next() {
    const std::size_t i = waiting_.top().second;
    waiting_.pop();
    parts_[i]->next();
    add(i);
  }

 private:
  void add(std::size_t i) {
    if (parts_[i]->at != nullptr) waiting_.emplace(parts_[i]->at->number, i);
  }
  using Entry = std::pair<std::uint64_t, std::size_t>;
  Parts& parts_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> waiting_;
};

/// Of a case that an earlier part had as `first`.
void check_same(const CaseResult& first, const Part& earlier, const Part& part) {
  if (canonical_line(first) == canonical_line(*part.at)) return;
  throw StartError(on_one_line(part.store.path().string()) + ": has another result of case " +
                   std::to_string(first.number) + " than " +
                   on_one_line(earlier.store.path().string()));
}

/// How many there were.
std::uint64_t copy_cases(Parts& parts, CaseRows& rows) {
  std::uint64_t cases = 0;
  const Part* earlier = nullptr;
  for (ByNumber order(parts); const Part* const part = order.top(); order.next()) {
    if (rows.insert(*part->at)) {
      earlier = part;
      ++cases;
    } else {
      check_same(*rows.find(part->at->number), *earlier, *part);
    }
  }
  return cases;
}

std::vector<Shard> shards_of(const Parts& parts) {
  std::set<Shard> shards;
  for (const auto& part : parts) {
    for (const Shard& shard : part->store.shards()) shards.insert(shard);
  }
  return {shards.begin(), shards.end()};
}

/// Where all are shards of one division.
std::vector<Shard> missing_of(const std::vector<Shard>& shards) {
  std::vector<Shard> missing;
  const auto other = [&](const Shard& shard) { return shard.of != shards.front().of; };
  if (shards.empty() || std::ranges::any_of(shards, other)) return missing;
  const std::uint64_t of = shards.front().of;
  for (std::uint64_t i = 0; i < of; ++i) {
    if (!std::ranges::binary_search(shards, Shard{i, of})) missing.push_back({i, of});
  }
  return missing;
}

}  // namespace

std::string MergeSummary::text() const {
  std::string text = std::to_string(cases) + " of " + std::to_string(of) + " cases";
  for (std::size_t i = 0; i < std::min(missing.size(), kNamed); ++i) {
    text += (i == 0 ? "; missing: shard " : ", ") + std::to_string(missing[i].index) + "/" +
            std::to_string(missing[i].of);
  }
  if (missing.size() > kNamed) {
    text += " and " + std::to_string(missing.size() - kNamed) + " more";
  }
  if (missing.empty() && lacks > 0) {
    text += "; missing: " + std::to_string(lacks) + " of shards that were interrupted";
  }
  return text;
}

MergeSummary merge_campaigns(const fs::path& out, std::span<const fs::path> paths) {
  if (paths.empty()) throw StartError("merge: needs the files of a campaign");
  NewFile file(out);
  Parts parts = open_parts(paths);
  const CampaignHead& head = parts.front()->store.head();
  const std::vector<Shard> shards = shards_of(parts);
  MergeSummary summary{
      .cases = 0, .of = head.cases, .lacks = 0, .missing = missing_of(shards), .is_whole = false};
  {
    Database database(file.unfinished());
    write_schema(database, head);
    CaseRows rows(database, head);
    Transaction all(database);
    summary.cases = copy_cases(parts, rows);
    for (const Shard& shard : shards) write_shard(database, shard);
    all.commit();
  }
  file.finish();
  summary.lacks = missing_cases(head, summary.cases);
  summary.is_whole =
      head.sampling == Sampling::kAdaptive || (summary.lacks == 0 && summary.missing.empty());
  return summary;
}

}  // namespace lk::emulator

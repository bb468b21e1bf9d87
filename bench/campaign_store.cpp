// What the results of a campaign cost: campaign_store DIRECTORY [CASES [SHARDS]]. Makes the shards'
// files in DIRECTORY, which it makes itself, merges them, and prints seconds and bytes of each
// step. The cases are those of the tests.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/tools/campaign/results/synthetic.hpp"
#include "tools/campaign/results/canonical.hpp"
#include "tools/campaign/results/merge.hpp"
#include "tools/campaign/results/sqlite.hpp"

namespace {

using namespace lk::emulator;
namespace fs = std::filesystem;

constexpr std::size_t kBatch = 1000;

template <class Step>
void timed(const char* name, double cases, Step step) {
  const auto begin = std::chrono::steady_clock::now();
  const double bytes = static_cast<double>(step());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("%-30s %8.2f s %9.0f cases/s", name, took.count(), cases / took.count());
  if (bytes > 0) std::printf(" %12.0f bytes, %.1f a case", bytes, bytes / cases);
  std::printf("\n");
}

std::uintmax_t put_shard(const fs::path& path, const CampaignHead& head, Shard shard) {
  auto store = CampaignStore::create(path, head);
  store.note_shard(shard);
  std::vector<CaseResult> batch;
  for (std::uint64_t n = shard.index; n < head.numbers; n += shard.of) {
    batch.push_back(lk::test::synthetic_case(n));
    if (batch.size() < kBatch) continue;
    store.put(batch);
    batch.clear();
  }
  store.put(batch);
  return fs::file_size(path);
}

std::uintmax_t ask(const fs::path& path, const char* question) {
  const Database database(path);
  Statement row(database, question);
  while (row.step()) {
  }
  return 0;
}

int measure(const fs::path& directory, std::uint64_t numbers, std::uint64_t shards) {
  fs::create_directory(directory);
  const CampaignHead head = lk::test::synthetic_head(numbers);
  const auto cases = static_cast<double>(numbers);
  std::vector<fs::path> parts;
  timed("put, batches of 1000", cases, [&] {
    std::uintmax_t bytes = 0;
    for (std::uint64_t i = 0; i < shards; ++i) {
      parts.push_back(directory / (std::to_string(i) + ".db"));
      bytes += put_shard(parts.back(), head, {i, shards});
    }
    return bytes;
  });
  const fs::path all = directory / "all.db";
  timed("merge", cases, [&] {
    merge_campaigns(all, parts);
    return fs::file_size(all);
  });
  timed("canonical export", cases, [&] {
    std::uintmax_t bytes = 0;
    export_canonical(CampaignStore::read(all),
                     [&](std::string_view text) { bytes += text.size(); });
    return bytes;
  });
  timed("SELECT outcome, count(*)", cases,
        [&] { return ask(all, "SELECT outcome, count(*) FROM cases GROUP BY outcome"); });
  timed("SELECT fault.kind, outcome", cases, [&] {
    return ask(all, "SELECT \"fault.kind\", outcome, count(*) FROM cases GROUP BY 1, 2");
  });
  timed("the test's own drawing of cases", cases, [&] {
    std::uint64_t sum = 0;
    for (std::uint64_t n = 0; n < numbers; ++n) sum += lk::test::synthetic_case(n).runs;
    return sum == numbers ? 0 : 1;
  });
  return 0;
}

std::uint64_t number_or(const char* text, std::uint64_t otherwise) {
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

}  // namespace

int main(int count, char** words) {
  if (count < 2) {
    std::fprintf(stderr, "usage: campaign_store DIRECTORY [CASES [SHARDS]]\n");
    return 2;
  }
  return measure(words[1], number_or(count > 2 ? words[2] : nullptr, 1'000'000),
                 number_or(count > 3 ? words[3] : nullptr, 4));
}

#include "tools/campaign/results/campaign_store.hpp"

#include <string>

#include "emulator/ground/start_error.hpp"
#include "tools/campaign/results/canonical.hpp"
#include "tools/campaign/results/case_rows.hpp"
#include "tools/campaign/results/new_file.hpp"
#include "tools/campaign/results/same_campaign.hpp"
#include "tools/campaign/results/schema.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

namespace {

/// For as long as the file is open. Shared by those who read: that of a transaction. Of one who
/// writes: from before the first look at it on, and between its transactions too. Readers go from
/// the beginning to the end and need no pages twice; a merge has a thousand of them.
constexpr const char* kReadersLock = "PRAGMA cache_size = -64; BEGIN";
constexpr const char* kWritersLock = "PRAGMA locking_mode = EXCLUSIVE; BEGIN EXCLUSIVE";

CampaignHead locked_head(Database& database, const char* lock) {
  database.run(lock);
  return read_head(database);
}

}  // namespace

struct CampaignStore::File {
  File(const fs::path& path, const char* lock)
      : database(path), head(locked_head(database, lock)) {}

  std::uint64_t count() {
    if (!cases) {
      Statement row(database, "SELECT count(*) FROM results");
      row.step();
      cases = static_cast<std::uint64_t>(row.integer());
    }
    return *cases;
  }
  void insert(const CaseResult& result);
  void write();

  Database database;
  CampaignHead head;
  CaseRows rows{database, head};
  std::optional<std::uint64_t> cases;  // counted once
  bool writes = false;
};

/// The journal is SQLite's older kind, and not a write-ahead log: that one needs memory that all
/// who have the file open share, and on a file system of a network they do not.
void CampaignStore::File::write() {
  database.run("COMMIT; PRAGMA journal_mode = TRUNCATE; PRAGMA synchronous = FULL");
  writes = true;
}

void CampaignStore::File::insert(const CaseResult& result) {
  if (rows.insert(result)) return;
  if (canonical_line(*rows.find(result.number)) != canonical_line(result)) {
    database.fail("has another result of case " + std::to_string(result.number));
  }
}

CampaignStore CampaignStore::create(const fs::path& path, const CampaignHead& head) {
  NewFile file(path);
  {
    Database database(file.unfinished());
    write_schema(database, head);
  }
  file.finish();
  return resume(path, head);
}

CampaignStore CampaignStore::resume(const fs::path& path, const CampaignHead& head) {
  auto file = std::make_unique<File>(path, kWritersLock);
  if (const auto other = difference(file->head, head)) file->database.fail(*other);
  file->write();
  return CampaignStore(std::move(file));
}

CampaignStore CampaignStore::read(const fs::path& path) {
  return CampaignStore(std::make_unique<File>(path, kReadersLock));
}

CampaignStore::CampaignStore(std::unique_ptr<File> file) : file_(std::move(file)) {}
CampaignStore::CampaignStore(CampaignStore&&) noexcept = default;
CampaignStore& CampaignStore::operator=(CampaignStore&&) noexcept = default;

CampaignStore::~CampaignStore() {
  if (!file_ || !file_->writes) return;
  try {
    // Takes the empty journal away.
    file_->database.run("PRAGMA locking_mode = NORMAL; PRAGMA journal_mode = DELETE");
  } catch (const StartError&) {
    // It does no harm.
  }
}

const CampaignHead& CampaignStore::head() const { return file_->head; }
const fs::path& CampaignStore::path() const { return file_->database.path(); }

void CampaignStore::put(std::span<const CaseResult> results) {
  if (results.empty()) return;
  const std::size_t words = file_->rows.words().size();
  file_->cases.reset();
  try {
    Transaction all(file_->database);
    for (const auto& result : results) file_->insert(result);
    all.commit();
  } catch (...) {
    file_->rows.words().forget_after(words);
    throw;
  }
}

bool CampaignStore::has(std::uint64_t number) const { return file_->rows.has(number); }
std::uint64_t CampaignStore::count() const { return file_->count(); }
std::optional<CaseResult> CampaignStore::find(std::uint64_t number) const {
  return file_->rows.find(number);
}

CaseCursor CampaignStore::cursor() const { return file_->rows.cursor(); }
void CampaignStore::for_each(const std::function<void(const CaseResult&)>& take) const {
  CaseCursor cases = cursor();
  while (const CaseResult* const one = cases.next()) take(*one);
}

void CampaignStore::note_shard(Shard shard) { write_shard(file_->database, shard); }

std::vector<Shard> CampaignStore::shards() const { return read_shards(file_->database); }

}  // namespace lk::emulator

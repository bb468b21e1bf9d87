#include "tools/campaign/results/schema.hpp"

#include <algorithm>
#include <bit>
#include <vector>

#include "emulator/ground/text.hpp"
#include "tools/campaign/results/columns.hpp"

namespace lk::emulator {
namespace {

constexpr std::int64_t kApplication = 0x4C4B4643;  // "LKFC": what file(1) shows
constexpr std::int64_t kFormat = 2;

struct Object {
  std::string name;
  std::string sql;  // to the letter as it is kept in the file
};

std::string quoted(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) {
    if (c == '"') text += '"';
    text += c;
  }
  return text + '"';
}

/// What a column is in `results`.
struct StoredAs {
  std::string sql = "CREATE TABLE results (number INTEGER PRIMARY KEY";
  void add(std::string_view name, std::string_view type) {
    sql.append(", ").append(name).append(" ").append(type);
  }
  void operator()(const char* name, CaseOutcome) { add(name, "INTEGER NOT NULL"); }
  void operator()(const char* name, std::uint32_t) { add(name, "INTEGER NOT NULL"); }
  void operator()(const char* name, bool) { add(name, "INTEGER NOT NULL"); }
  void operator()(const char* name, const std::optional<SimTime>&) { add(name, "INTEGER"); }
  void operator()(const char* name, Word<const std::string>) { add(name, "INTEGER"); }
  void operator()(const char* name, const std::optional<double>&) { add(name, "REAL"); }
  void operator()(const char* name, const std::string&) { add(name, "TEXT NOT NULL"); }
};

std::string looked_up(const std::string& column, const std::string& name) {
  return ", (SELECT word FROM words WHERE id = r." + column + ") AS " + name;
}

/// And what people see in `cases`.
struct ShownAs {
  std::string sql;
  void operator()(const char* name, CaseOutcome) { sql += looked_up(name, name); }
  void operator()(const char* name, Word<const std::string>) { sql += looked_up(name, name); }
  template <class Other>
  void operator()(const char* name, const Other&) {
    sql.append(", r.").append(name);
  }
};

Object results_table(const CampaignHead& head) {
  StoredAs stored;
  each_column(stored);
  stored.add("wall_us", "INTEGER NOT NULL");
  stored.add("said", "TEXT NOT NULL");
  for (std::size_t i = 0; i < head.dimensions.size(); ++i) {
    stored.add("v" + std::to_string(i), head.dimensions[i].words.empty() ? "REAL" : "INTEGER");
  }
  return {"results", stored.sql + ") STRICT"};
}

Object cases_view(const CampaignHead& head) {
  std::string sql = "CREATE VIEW cases AS SELECT r.number AS number";
  for (std::size_t i = 0; i < head.dimensions.size(); ++i) {
    const std::string column = "v" + std::to_string(i);
    const std::string name = quoted(head.dimensions[i].name);
    sql += head.dimensions[i].words.empty() ? ", r." + column + " AS " + name
                                            : looked_up(column, name);
  }
  ShownAs shown;
  each_column(shown);
  return {"cases",
          sql + shown.sql + ", r.said AS said, r.wall_us / 1e6 AS wall_s FROM results AS r"};
}

std::vector<Object> objects(const CampaignHead& head) {
  return {
      {"campaign",
       "CREATE TABLE campaign (version TEXT NOT NULL, plan_name TEXT NOT NULL, "
       "about TEXT NOT NULL, plan_text TEXT NOT NULL, input_hash TEXT NOT NULL, "
       "sampling TEXT NOT NULL, seed INTEGER NOT NULL, numbers INTEGER NOT NULL, "
       "cases INTEGER NOT NULL, plan_called TEXT NOT NULL, tolerant_time_ns INTEGER) STRICT"},
      {"dimensions",
       "CREATE TABLE dimensions (position INTEGER PRIMARY KEY, name TEXT NOT NULL, "
       "least REAL NOT NULL, most REAL NOT NULL, harmless_is_most INTEGER NOT NULL) STRICT"},
      {"dimension_words",
       "CREATE TABLE dimension_words (dimension INTEGER NOT NULL, position INTEGER NOT NULL, "
       "word TEXT NOT NULL, PRIMARY KEY (dimension, position)) STRICT, WITHOUT ROWID"},
      {"shards",
       "CREATE TABLE shards (shard INTEGER NOT NULL, shards INTEGER NOT NULL, "
       "PRIMARY KEY (shards, shard)) STRICT, WITHOUT ROWID"},
      {"words", "CREATE TABLE words (id INTEGER PRIMARY KEY, word TEXT NOT NULL) STRICT"},
      results_table(head),
      cases_view(head),
  };
}

/// SQLite's names of columns are the same in small letters.
void check_names(const Database& database, const CampaignHead& head) {
  std::vector<std::string> names = {"number", "said", "wall_s"};
  each_column([&](const char* name, const auto&) { names.emplace_back(name); });
  for (const auto& dimension : head.dimensions) {
    std::string name = small_letters(dimension.name);
    if (std::ranges::find(names, name) != names.end()) {
      database.fail("two columns would be named " + on_one_line(dimension.name));
    }
    names.push_back(std::move(name));
  }
}

void write_dimensions(const Database& database, const CampaignHead& head) {
  Statement dimension(database, "INSERT INTO dimensions VALUES (?, ?, ?, ?, ?)");
  Statement word(database, "INSERT INTO dimension_words VALUES (?, ?, ?)");
  std::int64_t position = 0;
  for (const auto& one : head.dimensions) {
    dimension.bind(position).bind(one.name).bind(one.from).bind(one.to);
    dimension.bind(std::int64_t{one.least_is_to}).run();
    std::int64_t place = 0;
    for (const auto& text : one.words) word.bind(position).bind(place++).bind(text).run();
    ++position;
  }
}

void write_head(const Database& database, const CampaignHead& head) {
  Statement campaign(database, "INSERT INTO campaign VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  campaign.bind(head.version).bind(head.plan_name).bind(head.about).bind(head.plan_text);
  campaign.bind(head.input_hash).bind(kSamplingWords[static_cast<std::size_t>(head.sampling)]);
  campaign.bind(std::bit_cast<std::int64_t>(head.seed));
  campaign.bind(static_cast<std::int64_t>(head.numbers));
  campaign.bind(static_cast<std::int64_t>(head.cases));
  campaign.bind(head.plan_called.word);
  head.tolerant_time ? campaign.bind(std::int64_t{head.tolerant_time->count()})
                     : campaign.bind_nothing();
  campaign.run();
}

/// Outcomes have their own numbers; every other word has the next one that is free.
void write_outcomes(const Database& database) {
  Statement word(database, "INSERT INTO words VALUES (?, ?)");
  std::int64_t id = 0;
  for (const auto text : kCaseOutcomeWords) word.bind(id++).bind(text).run();
}

std::int64_t pragma(const Database& database, const std::string& name) {
  Statement value(database, "PRAGMA " + name);
  return value.step() ? value.integer() : 0;
}

/// SQLite takes what is missing of the last page for zeros.
void check_size(const Database& database) {
  const std::int64_t size = pragma(database, "page_count") * pragma(database, "page_size");
  std::error_code error;
  const auto there = std::filesystem::file_size(database.path(), error);
  if (error || there < static_cast<std::uintmax_t>(size)) database.fail_damaged();
}

void read_dimensions(const Database& database, CampaignHead& head) {
  Statement row(database, "SELECT * FROM dimensions ORDER BY position");
  while (row.step()) {
    const auto place = static_cast<std::int64_t>(head.dimensions.size());
    row.integer(place, place);
    DimensionHead one;
    one.name = row.text();
    one.from = row.real();
    one.to = row.real();
    one.least_is_to = row.integer(0, 1) != 0;
    head.dimensions.push_back(std::move(one));
  }
  Statement word(database, "SELECT * FROM dimension_words ORDER BY dimension, position");
  const auto last = static_cast<std::int64_t>(head.dimensions.size()) - 1;
  while (word.step()) {
    auto& words = head.dimensions[static_cast<std::size_t>(word.integer(0, last))].words;
    const auto place = static_cast<std::int64_t>(words.size());
    word.integer(place, place);
    words.push_back(word.text());
  }
}

CampaignHead read_campaign(const Database& database) {
  Statement row(database, "SELECT * FROM campaign");
  if (!row.step()) database.fail_damaged();
  CampaignHead head;
  head.version = row.text();
  head.plan_name = row.text();
  head.about = row.text();
  head.plan_text = row.text();
  head.input_hash = row.text();
  const auto sampling = std::ranges::find(kSamplingWords, row.text());
  if (sampling == kSamplingWords.end()) database.fail_damaged();
  head.sampling = static_cast<Sampling>(sampling - kSamplingWords.begin());
  head.seed = std::bit_cast<std::uint64_t>(row.integer());
  head.numbers = static_cast<std::uint64_t>(row.integer(0, kMostNumbers));
  head.cases = static_cast<std::uint64_t>(row.integer(0, kMostNumbers));
  head.plan_called.word = row.text();
  if (!row.next_is_nothing()) head.tolerant_time = SimTime(row.integer(0));  // the last one
  return head;
}

void check_objects(const Database& database, const CampaignHead& head) {
  Statement kept(database, "SELECT sql FROM sqlite_schema WHERE name = ?");
  for (const auto& object : objects(head)) {
    if (!kept.bind(object.name).step() || kept.text() != object.sql) database.fail_damaged();
    kept.reset();
  }
}

}  // namespace

void write_schema(Database& database, const CampaignHead& head) {
  check_names(database, head);
  if (head.numbers > kMostNumbers) database.fail("too many cases");
  // Nobody goes on with what is unfinished.
  database.run("PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF");
  Transaction all(database);
  database.run("PRAGMA application_id = " + std::to_string(kApplication) +
               "; PRAGMA user_version = " + std::to_string(kFormat));
  for (const auto& object : objects(head)) database.run(object.sql);
  write_head(database, head);
  write_dimensions(database, head);
  write_outcomes(database);
  all.commit();
}

CampaignHead read_head(const Database& database) {
  check_size(database);
  if (pragma(database, "application_id") != kApplication) {
    database.fail("not the results of a campaign");
  }
  const std::int64_t format = pragma(database, "user_version");
  if (format != kFormat) {
    database.fail("its format is " + std::to_string(format) + ", and this program reads " +
                  std::to_string(kFormat));
  }
  CampaignHead head = read_campaign(database);
  read_dimensions(database, head);
  check_objects(database, head);
  return head;
}

}  // namespace lk::emulator

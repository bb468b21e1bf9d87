#include "tools/campaign/results/case_rows.hpp"

#include <sqlite3.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tools/campaign/results/columns.hpp"
#include "tools/campaign/results/schema.hpp"

namespace lk::emulator {
namespace {

constexpr double kUsPerS = 1e6;

[[noreturn]] void refuse(const CaseResult& result, const std::string& why) {
  throw std::invalid_argument("case " + std::to_string(result.number) + ": " + why);
}

bool is_usable(const std::optional<CaseValue>& value, const DimensionHead& dimension) {
  if (!value) return true;
  const double* const number = std::get_if<double>(&*value);
  return number != nullptr ? dimension.words.empty() && !std::isnan(*number)
                           : !dimension.words.empty();
}

struct CheckColumn {
  const CaseResult& result;
  void operator()(const char* name, const std::optional<SimTime>& time) const {
    if (time && *time < SimTime(0)) refuse(result, std::string(name) + " is negative");
  }
  void operator()(const char* name, const std::optional<double>& value) const {
    if (value && std::isnan(*value)) refuse(result, std::string(name) + " is no number");
  }
  template <class Other>
  void operator()(const char*, const Other&) const {}
};

void check(const CaseResult& result, const CampaignHead& head) {
  if (result.number >= head.numbers) refuse(result, "not of this campaign");
  if (result.values.size() != head.dimensions.size()) refuse(result, "other dimensions");
  for (std::size_t i = 0; i < head.dimensions.size(); ++i) {
    if (!is_usable(result.values[i], head.dimensions[i])) {
      refuse(result, "no value of " + head.dimensions[i].name);
    }
  }
  each_column(result, CheckColumn{result});
}

struct BindColumn {
  Statement& row;
  WordTable& words;
  void operator()(const char*, CaseOutcome outcome) {
    row.bind(static_cast<std::int64_t>(outcome));
  }
  void operator()(const char*, std::uint32_t count) { row.bind(std::int64_t{count}); }
  void operator()(const char*, bool flag) { row.bind(std::int64_t{flag}); }
  void operator()(const char*, const std::optional<SimTime>& time) {
    time ? row.bind(std::int64_t{time->count()}) : row.bind_nothing();
  }
  void operator()(const char*, Word<const std::string> word) {
    word.text.empty() ? row.bind_nothing() : row.bind(words.number_of(word.text));
  }
  void operator()(const char*, const std::optional<double>& value) {
    value ? row.bind(*value) : row.bind_nothing();
  }
  void operator()(const char*, const std::string& text) { row.bind(std::string_view(text)); }
};

void bind_value(Statement& row, WordTable& words, const std::optional<CaseValue>& value) {
  if (!value) {
    row.bind_nothing();
  } else if (const double* const number = std::get_if<double>(&*value)) {
    row.bind(*number);
  } else {
    row.bind(words.number_of(std::get<std::string>(*value)));
  }
}

/// Of a clock, which may have been set back, and of a case that nobody timed.
std::int64_t wall_us(double wall_s) {
  return wall_s > 0 && wall_s < 1e12 ? std::llround(wall_s * kUsPerS) : 0;
}

struct ReadColumn {
  Statement& row;
  const WordTable& words;
  bool nothing() {
    const bool is = row.next_is_nothing();
    if (is) row.skip();
    return is;
  }
  void operator()(const char*, CaseOutcome& outcome) {
    outcome = static_cast<CaseOutcome>(row.integer(0, kCaseOutcomes - 1));
  }
  void operator()(const char*, std::uint32_t& count) {
    count = static_cast<std::uint32_t>(row.integer(0, std::numeric_limits<std::uint32_t>::max()));
  }
  void operator()(const char*, bool& flag) { flag = row.integer(0, 1) != 0; }
  void operator()(const char*, std::optional<SimTime>& time) {
    time = nothing() ? std::nullopt : std::optional(SimTime(row.integer(0)));
  }
  void operator()(const char*, Word<std::string> word) {
    word.text = nothing() ? "" : words.at(row.integer());
  }
  void operator()(const char*, std::optional<double>& value) {
    value = nothing() ? std::nullopt : std::optional(row.real());
  }
  void operator()(const char*, std::string& text) { text = row.text(); }
};

/// The columns of `kSelect`, in their order. Reuses what `result` has of memory.
void read_case(Statement& row, const WordTable& words, const CampaignHead& head,
               CaseResult& result) {
  const auto last = static_cast<std::int64_t>(head.numbers) - 1;
  result.number = static_cast<std::uint64_t>(row.integer(0, last));
  ReadColumn read{row, words};
  each_column(result, read);
  result.wall_s = static_cast<double>(row.integer(0)) / kUsPerS;
  result.said = row.text();
  result.values.resize(head.dimensions.size());
  for (std::size_t i = 0; i < head.dimensions.size(); ++i) {
    auto& value = result.values[i];
    if (read.nothing()) {
      value.reset();
    } else if (head.dimensions[i].words.empty()) {
      value = row.real();
    } else {
      value = words.at(row.integer());
    }
  }
}

/// Whatever the order of its columns in the file: that of the schema, which was checked.
constexpr const char* kSelect = "SELECT * FROM results";

std::string insert_text(const CampaignHead& head) {
  std::size_t columns = 3 + head.dimensions.size();  // number, wall_us and said
  each_column([&](const char*, const auto&) { ++columns; });
  std::string text = "INSERT INTO results VALUES (?";
  while (--columns > 0) text += ", ?";
  return text + ") ON CONFLICT DO NOTHING";
}

}  // namespace

WordTable::WordTable(const Database& database)
    : database_(database), insert_(database, "INSERT INTO words VALUES (?, ?)") {
  Statement row(database, "SELECT id, word FROM words ORDER BY id");
  while (row.step()) {
    const auto number = static_cast<std::int64_t>(by_number_.size());
    row.integer(number, number);
    by_number_.push_back(row.text());
    numbers_.emplace(by_number_.back(), number);
  }
  if (by_number_.size() < kCaseOutcomes) database.fail_damaged();
}

std::int64_t WordTable::number_of(const std::string& word) {
  const auto known = numbers_.find(word);
  if (known != numbers_.end()) return known->second;
  const auto number = static_cast<std::int64_t>(by_number_.size());
  insert_.reset();
  insert_.bind(number).bind(std::string_view(word)).run();
  by_number_.push_back(word);
  numbers_.emplace(word, number);
  return number;
}

const std::string& WordTable::at(std::int64_t number) const {
  if (number < 0 || static_cast<std::size_t>(number) >= by_number_.size()) database_.fail_damaged();
  return by_number_[static_cast<std::size_t>(number)];
}

void WordTable::forget_after(std::size_t size) {
  for (; by_number_.size() > size; by_number_.pop_back()) {
    numbers_.erase(by_number_.back());
  }
}

CaseCursor::CaseCursor(const Database& database, const WordTable& words, const CampaignHead& head)
    : select_(database, std::string(kSelect) + " ORDER BY number"), words_(words), head_(head) {}

const CaseResult* CaseCursor::next() {
  if (!select_.step()) return nullptr;
  read_case(select_, words_, head_, result_);
  if (result_.number < least_) select_.database().fail_damaged();
  least_ = result_.number + 1;
  return &result_;
}

CaseRows::CaseRows(const Database& database, const CampaignHead& head)
    : database_(database),
      head_(head),
      words_(database),
      insert_(database, insert_text(head)),
      has_(database, "SELECT 1 FROM results WHERE number = ?"),
      find_(database, std::string(kSelect) + " WHERE number = ?") {}

bool CaseRows::insert(const CaseResult& result) {
  check(result, head_);
  insert_.reset();
  insert_.bind(static_cast<std::int64_t>(result.number));
  each_column(result, BindColumn{insert_, words_});
  insert_.bind(wall_us(result.wall_s)).bind(std::string_view(result.said));
  for (const auto& value : result.values) bind_value(insert_, words_, value);
  insert_.run();
  return ::sqlite3_changes(database_.handle()) > 0;
}

bool CaseRows::has(std::uint64_t number) {
  if (number >= head_.numbers) return false;
  has_.reset();
  const bool there = has_.bind(static_cast<std::int64_t>(number)).step();
  has_.reset();
  return there;
}

std::optional<CaseResult> CaseRows::find(std::uint64_t number) {
  if (number >= head_.numbers) return std::nullopt;
  find_.reset();
  std::optional<CaseResult> found;
  if (find_.bind(static_cast<std::int64_t>(number)).step()) {
    read_case(find_, words_, head_, found.emplace());
  }
  find_.reset();
  return found;
}

}  // namespace lk::emulator

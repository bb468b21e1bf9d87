#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "tools/campaign/results/case_result.hpp"
#include "tools/campaign/results/sqlite.hpp"

namespace lk::emulator {

/// Texts that many cases share, by the numbers that stand for them in a file.
class WordTable {
 public:
  /// All that the file has.
  explicit WordTable(const Database& database);
  std::size_t size() const { return by_number_.size(); }
  /// Writes it, when it is new.
  std::int64_t number_of(const std::string& word);
  /// Throws StartError when the file has no such number.
  const std::string& at(std::int64_t number) const;
  /// Those that came since it had this size: their transaction has been taken back.
  void forget_after(std::size_t size);

 private:
  const Database& database_;
  Statement insert_;
  std::vector<std::string> by_number_;
  std::unordered_map<std::string, std::int64_t> numbers_;
};

/// Cases of a file in ascending order.
class CaseCursor {
 public:
  CaseCursor(const Database& database, const WordTable& words, const CampaignHead& head);
  /// Null after the last. Stands until the next call.
  const CaseResult* next();

 private:
  Statement select_;
  const WordTable& words_;
  const CampaignHead& head_;
  std::uint64_t least_ = 0;  // that the next number may be
  CaseResult result_;
};

/// The cases of an open file, which its database and head outlive.
class CaseRows {
 public:
  CaseRows(const Database& database, const CampaignHead& head);
  /// False: a case of this number is there, and stays. Throws std::invalid_argument when the result
  /// is none of this campaign.
  bool insert(const CaseResult& result);
  bool has(std::uint64_t number);
  std::optional<CaseResult> find(std::uint64_t number);
  CaseCursor cursor() const { return {database_, words_, head_}; }
  WordTable& words() { return words_; }

 private:
  const Database& database_;
  const CampaignHead& head_;
  WordTable words_;
  Statement insert_;
  Statement has_;
  Statement find_;
};

}  // namespace lk::emulator

#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace lk::emulator {

/// An open SQLite file. Nothing that lies in a file is run: no triggers, no extensions. For one
/// thread at a time.
class Database {
 public:
  /// A file that is there. Throws StartError, as all of this does: one line that begins with the
  /// path.
  explicit Database(const std::filesystem::path& path);
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database();

  /// Statements, separated by semicolons.
  void run(const std::string& sql);
  sqlite3* handle() const { return handle_; }
  const std::filesystem::path& path() const { return path_; }

  /// Says what SQLite's `code` means to a person.
  [[noreturn]] void fail(int code) const;
  /// The path and `what`.
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_damaged() const;

 private:
  std::filesystem::path path_;
  sqlite3* handle_ = nullptr;
};

/// One statement, to be run once or often; ends before its database does.
class Statement {
 public:
  Statement(const Database& database, std::string_view sql);
  Statement(Statement&& other) noexcept;
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement();

  /// The next of its parameters, from the first. Text has to stay until the last step.
  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::string_view value);
  Statement& bind_nothing();
  /// True: there is a row.
  bool step();
  /// To the end, where rows are not expected; and ready to be run again.
  void run();
  void reset();

  /// The next column of the row, from the first.
  bool next_is_nothing() const;
  std::int64_t integer();
  double real();
  std::string text();
  /// Throws StartError that the file is damaged when it is nothing or not in this range.
  std::int64_t integer(std::int64_t from,
                       std::int64_t to = std::numeric_limits<std::int64_t>::max());
  void skip() { ++column_; }

  const Database& database() const { return *database_; }

 private:
  void check(int code) const;

  const Database* database_;
  sqlite3_stmt* handle_ = nullptr;
  int parameter_ = 1;
  int column_ = 0;
};

/// All that is run until it is committed happens, or nothing.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) { database_.run("BEGIN"); }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();
  void commit();

 private:
  Database& database_;
  bool done_ = false;
};

}  // namespace lk::emulator

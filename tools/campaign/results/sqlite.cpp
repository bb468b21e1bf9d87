#include "tools/campaign/results/sqlite.hpp"

#include <sqlite3.h>

#include <cerrno>
#include <utility>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

Database::Database(const fs::path& path) : path_(path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) fail(reason_of(error ? error.value() : ENOENT));
  if (!fs::is_regular_file(status)) fail("not a regular file");
  // Absolute: SQLite takes some names for something else (":memory:").
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  const int code = ::sqlite3_open_v2(fs::absolute(path).c_str(), &handle_, flags, nullptr);
  try {
    if (code != SQLITE_OK) fail(code);
    ::sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    ::sqlite3_db_config(handle_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    run("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON");
  } catch (...) {
    ::sqlite3_close(handle_);
    throw;
  }
}

Database::~Database() { ::sqlite3_close(handle_); }

void Database::run(const std::string& sql) {
  const int code = ::sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

void Database::fail(const std::string& what) const {
  throw StartError(on_one_line(path_.string()) + ": " + what);
}

void Database::fail_damaged() const { fail("damaged"); }

void Database::fail(int code) const {
  const auto because = [this](const char* what) {
    const int error = handle_ != nullptr ? ::sqlite3_system_errno(handle_) : 0;
    return error != 0 ? std::string(what) + ": " + reason_of(error) : std::string(what);
  };
  if (code == SQLITE_READONLY_ROLLBACK || code == SQLITE_READONLY_RECOVERY) {
    fail("its program was killed while it wrote, and to undo that takes the right to write");
  }
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      fail("another process has it open; wait for its end");
    case SQLITE_NOTADB:
      fail("not the results of a campaign");
    case SQLITE_CORRUPT:
      fail_damaged();
    case SQLITE_FULL:
      fail("no space left to write it");
    case SQLITE_READONLY:
      fail("you may not write it");
    case SQLITE_CANTOPEN:
      if (::sqlite3_system_errno(handle_) == EMFILE)
        fail("too many files are open at a time; merge some of them first");
      fail(because("cannot be opened"));
    case SQLITE_IOERR:
      if (code == SQLITE_IOERR_WRITE) fail("cannot be written: a quota, or a fault of the disk");
      fail(because("cannot be read or written"));
    default:
      fail(on_one_line(handle_ != nullptr ? ::sqlite3_errmsg(handle_) : ::sqlite3_errstr(code)));
  }
}

Statement::Statement(const Database& database, std::string_view sql) : database_(&database) {
  check(::sqlite3_prepare_v3(database.handle(), sql.data(), static_cast<int>(sql.size()),
                             SQLITE_PREPARE_PERSISTENT, &handle_, nullptr));
}

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_),
      handle_(std::exchange(other.handle_, nullptr)),
      parameter_(other.parameter_),
      column_(other.column_) {}

Statement::~Statement() { ::sqlite3_finalize(handle_); }

void Statement::check(int code) const {
  if (code != SQLITE_OK) database_->fail(code);
}

Statement& Statement::bind(std::int64_t value) {
  check(::sqlite3_bind_int64(handle_, parameter_++, value));
  return *this;
}
Statement& Statement::bind(double value) {
  check(::sqlite3_bind_double(handle_, parameter_++, value));
  return *this;
}
Statement& Statement::bind(std::string_view value) {
  check(::sqlite3_bind_text(handle_, parameter_++, value.data(), static_cast<int>(value.size()),
                            SQLITE_STATIC));
  return *this;
}
Statement& Statement::bind_nothing() {
  check(::sqlite3_bind_null(handle_, parameter_++));
  return *this;
}

bool Statement::step() {
  column_ = 0;
  const int code = ::sqlite3_step(handle_);
  if (code != SQLITE_ROW && code != SQLITE_DONE) database_->fail(code);
  return code == SQLITE_ROW;
}

void Statement::run() {
  while (step()) {
  }
  reset();
}

void Statement::reset() {
  ::sqlite3_reset(handle_);  // says again what step said
  parameter_ = 1;
}

bool Statement::next_is_nothing() const {
  return ::sqlite3_column_type(handle_, column_) == SQLITE_NULL;
}
std::int64_t Statement::integer() { return ::sqlite3_column_int64(handle_, column_++); }
double Statement::real() { return ::sqlite3_column_double(handle_, column_++); }

std::int64_t Statement::integer(std::int64_t from, std::int64_t to) {
  if (next_is_nothing()) database_->fail_damaged();
  const std::int64_t value = integer();
  if (value < from || value > to) database_->fail_damaged();
  return value;
}

std::string Statement::text() {
  const void* const bytes = ::sqlite3_column_blob(handle_, column_);
  const int size = ::sqlite3_column_bytes(handle_, column_++);
  return bytes == nullptr
             ? std::string()
             : std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(size));
}

Transaction::~Transaction() {
  // An error may have ended it already; then there is nothing to take back.
  if (!done_) ::sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  database_.run("COMMIT");
  done_ = true;
}

}  // namespace lk::emulator

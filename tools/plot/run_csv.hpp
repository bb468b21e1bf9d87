#pragma once

#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

/// A column of a CSV file of `lk-emu run` or `lk-emu replay`: "vcan0.1.speed_dps".
struct RunColumn {
  std::string bus;  // empty where there was only one
  int id;           // 0: of the body
  std::string signal;
};

/// Reads such a file, a row at a time, however long it is. Every function throws StartError, with
/// file and line.
class RunCsv {
 public:
  /// `name`: of the file, for complaints.
  RunCsv(std::unique_ptr<std::istream> stream, const std::string& name);

  const std::vector<RunColumn>& columns() const { return columns_; }

  /// The next row, values by column; one that is missing, or no number in its own words (nan), is a
  /// NaN. False at the end.
  bool next(double& time_s, std::vector<double>& values);

 private:
  bool next_line(std::string_view& line);
  void read_header(std::string_view line);
  RunColumn read_column(std::string_view name) const;
  double read_value(std::string_view text, std::size_t column) const;
  [[noreturn]] void fail(const std::string& why) const;

  std::string name_;
  std::unique_ptr<std::istream> stream_;
  std::vector<char> buffer_;
  long line_number_ = 0;
  std::vector<RunColumn> columns_;
  double last_time_s_ = 0;
  bool any_row_ = false;
};

/// Throws StartError.
RunCsv open_run_csv(const std::filesystem::path& file);

}  // namespace lk::emulator

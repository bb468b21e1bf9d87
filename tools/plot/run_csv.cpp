#include "tools/plot/run_csv.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "emulator/core/servo/body_signals.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/plot/svg_text.hpp"

namespace lk::emulator {
namespace {

// Room for the header of 32 drives with all signals on each of many buses.
constexpr std::size_t kLongestLine = 1 << 20;
// Every signal of 32 drives on 16 buses; assumed to be enough for anybody.
constexpr std::size_t kMostColumns = 16'384;
// Linux has no longer names of interfaces.
constexpr std::size_t kLongestBus = 15;
// So that the distance of two values is a number too.
constexpr double kLargest = 1e300;

constexpr const char* kForeign =
    "is not a CSV file of lk-emu run or lk-emu replay: the first line does not begin with time_s";

/// What is before the first comma; the rest stays.
std::string_view cut(std::string_view& line) {
  const std::size_t comma = line.find(',');
  const std::string_view field = line.substr(0, comma);
  line = comma == std::string_view::npos ? std::string_view() : line.substr(comma + 1);
  return field;
}

}  // namespace

RunCsv open_run_csv(const std::filesystem::path& file) {
  const std::string name = on_one_line(file.string());
  try {
    open_regular_file(file);
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("plot: ") + problem.what());
  }
  errno = 0;
  auto stream = std::make_unique<std::ifstream>(file, std::ios::binary);
  if (!*stream) throw StartError("plot: cannot read " + name + ": " + std::strerror(errno));
  return {std::move(stream), name};
}

RunCsv::RunCsv(std::unique_ptr<std::istream> stream, const std::string& name)
    : name_(on_one_line(name)), stream_(std::move(stream)), buffer_(kLongestLine) {
  std::string_view line;
  if (!next_line(line)) throw StartError("plot: " + name_ + " is empty");
  read_header(line);
}

bool RunCsv::next_line(std::string_view& line) {
  ++line_number_;
  stream_->getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  auto length = static_cast<std::size_t>(stream_->gcount());
  if (stream_->bad()) fail("cannot be read");
  if (stream_->eof() && length == 0) return false;
  if (stream_->fail()) fail(line_number_ == 1 ? kForeign : "is longer than any line of lk-emu");
  if (!stream_->eof()) --length;  // the end of the line counts
  line = std::string_view(buffer_.data(), length);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return true;
}

void RunCsv::read_header(std::string_view line) {
  if (line != "time_s" && !line.starts_with("time_s,")) fail(kForeign);
  cut(line);
  while (!line.empty()) {
    if (columns_.size() == kMostColumns) fail("more columns than lk-emu writes");
    RunColumn column = read_column(cut(line));
    const auto same = [&column](const RunColumn& other) {
      return other.bus == column.bus && other.id == column.id && other.signal == column.signal;
    };
    if (std::ranges::any_of(columns_, same)) {
      fail("column " + std::to_string(columns_.size() + 2) + " is there twice");
    }
    columns_.push_back(std::move(column));
  }
}

RunColumn RunCsv::read_column(std::string_view name) const {
  const std::size_t signal = name.rfind('.');
  const std::size_t id = signal == std::string_view::npos || signal == 0
                             ? std::string_view::npos
                             : name.rfind('.', signal - 1);
  RunColumn column{"", 0, ""};
  if (signal != std::string_view::npos) {
    const std::size_t begin = id == std::string_view::npos ? 0 : id + 1;
    if (id != std::string_view::npos) column.bus = on_one_line(name.substr(0, id));
    column.signal = name.substr(signal + 1);
    const char* const last = name.data() + signal;
    if (std::from_chars(name.data() + begin, last, column.id).ptr != last) column.id = 0;
  }
  if (column.id < 1 || column.id > 32 || column.bus.size() > kLongestBus) {
    if (name.starts_with(kBodyPrefix)) return {"", 0, on_one_line(name)};
    fail("column " + std::to_string(columns_.size() + 2) +
         " is not called like 1.speed_dps or vcan0.1.speed_dps");
  }
  return column;
}

bool RunCsv::next(double& time_s, std::vector<double>& values) {
  std::string_view line;
  if (!next_line(line)) return false;
  const auto fields = static_cast<std::size_t>(std::ranges::count(line, ',')) + 1;
  if (fields != columns_.size() + 1) {
    fail(std::to_string(fields) + " values, but the first line names " +
         std::to_string(columns_.size() + 1) + " columns");
  }
  time_s = read_value(cut(line), 0);
  if (!std::isfinite(time_s)) fail("has no time");
  if (any_row_ && time_s < last_time_s_) fail("is earlier than the line before it");
  any_row_ = true;
  last_time_s_ = time_s;
  values.clear();
  for (std::size_t n = 0; n < columns_.size(); ++n) values.push_back(read_value(cut(line), n + 1));
  return true;
}

double RunCsv::read_value(std::string_view text, std::size_t column) const {
  if (text.empty()) return std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  if (error != std::errc() || end != last) {
    fail("column " + std::to_string(column + 1) + " is not a number");
  }
  if (!std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
  return std::clamp(value, -kLargest, kLargest);
}

void RunCsv::fail(const std::string& why) const {
  throw StartError("plot: " + name_ + ":" + std::to_string(line_number_) + ": " + why);
}

}  // namespace lk::emulator

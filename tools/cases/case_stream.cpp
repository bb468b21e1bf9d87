#include "tools/cases/case_stream.hpp"

#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "emulator/core/start_error.hpp"
#include "emulator/files/output_file.hpp"
#include "tools/cases/case_batch.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kMaxPile = 128;          // cases that a thread takes at once
constexpr std::size_t kMaxLine = 1024 * 1024;  // bytes
constexpr std::size_t kMaxPileText =
    kMaxLine;  // bytes that end a pile: its cases take 100 times as much

/// Input and output lines. Thread-safe.
class Lines {
 public:
  explicit Lines(const CaseInput& options)
      : name_(options.file == "-" ? "standard input" : options.file),
        single_(!options.scenario.empty()) {
    const std::string& file = options.file;
    if (file == "-") return;
    opened_.open(file, std::ios::binary);
    if (!opened_) throw StartError("--cases: cannot read " + file);
    in_ = &opened_;
  }
  /// Reads the next cases, up to a blank line, kMaxPile or kMaxPileText. Returns none at the end of
  /// the input. Throws StartError.
  std::vector<CaseRequest> take() {
    const std::scoped_lock lock(in_mutex_);
    std::vector<CaseRequest> pile;
    std::string line;
    std::size_t text = 0;
    while (pile.size() < kMaxPile && text < kMaxPileText && next(line)) {
      text += line.size();
      if (line.find_first_not_of(" \t\r") == std::string::npos) {
        if (pile.empty()) continue;
        break;
      }
      add(line, pile);
    }
    return pile;
  }
  void put(const std::string& lines) {
    const std::scoped_lock lock(out_mutex_);
    const bool written = std::fwrite(lines.data(), 1, lines.size(), stdout) == lines.size();
    if (!written || std::fflush(stdout) != 0) throw StartError("standard output: cannot write");
  }
  bool all_read() const { return all_read_; }

 private:
  bool next(std::string& line) {
    line.clear();
    for (int c = in_->get(); c != std::istream::traits_type::eof(); c = in_->get()) {
      if (line.empty()) ++number_;
      if (c == '\n') return true;
      line += static_cast<char>(c);
      if (line.size() > kMaxLine) fail("is longer than 1 MB");
    }
    if (in_->bad()) throw StartError("--cases: cannot read " + name_);
    return !line.empty();
  }
  /// Adds the case of a line. Throws StartError if it is not a case. Reports an impossible case
  /// as a result, so that the program continues.
  void add(const std::string& line, std::vector<CaseRequest>& pile) {
    std::uint64_t number = 0;
    Json json;
    try {
      json = parse_json(line);
      number = read_case_number(json);
    } catch (const JsonError& problem) {
      fail(problem.where + ": " + problem.what());
    }
    try {
      pile.push_back(read_case(json));
    } catch (const std::exception& problem) {
      if (single_) throw StartError(problem.what());
      all_read_ = false;
      put(impossible_json(number, problem.what()));
    }
  }
  [[noreturn]] void fail(const std::string& reason) const {
    throw StartError("--cases: " + name_ + ":" + std::to_string(number_) + ": " + reason);
  }

  std::string name_;
  bool single_;  // true: the input is one case, and an impossible case ends the program
  std::ifstream opened_;
  std::istream* in_ = &std::cin;
  std::size_t number_ = 0;  // of the present line, from 1
  std::mutex in_mutex_, out_mutex_;
  bool all_read_ = true;
};

void write_scenario(Lines& lines, const std::string& file) {
  const std::vector<CaseRequest> cases = lines.take();
  if (cases.size() != 1 || !lines.take().empty()) {
    throw StartError("--scenario: needs exactly one case");
  }
  std::string text;
  try {
    text = CaseBuilder().file_text(cases.front());
  } catch (const std::exception& problem) {
    throw StartError(problem.what());
  }
  write_output(file, "--scenario", text);
}

}  // namespace

bool run_cases(const CaseInput& options) {
  std::ios::sync_with_stdio(false);
  Lines lines(options);
  if (!options.scenario.empty()) {
    write_scenario(lines, options.scenario);
    return true;
  }
  std::mutex mutex;
  bool all_possible = true;
  std::exception_ptr failure;
  const auto work = [&] {
    CaseBatch batch;
    try {
      for (;;) {
        {
          const std::scoped_lock lock(mutex);
          if (failure) return;
        }
        const std::vector<CaseRequest> pile = lines.take();
        if (pile.empty()) return;
        const bool possible =
            batch.run(pile, options.check, [&](const auto& out) { lines.put(out); });
        const std::scoped_lock lock(mutex);
        all_possible = all_possible && possible;
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    try {
      for (int n = 1; n < options.jobs; ++n) threads.emplace_back(work);
    } catch (const std::system_error&) {
      // Continues with fewer threads; the results are the same.
    }
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return all_possible && lines.all_read();
}

}  // namespace lk::emulator

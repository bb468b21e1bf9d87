#include "emulator/record/log_writer.hpp"

#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "emulator/files/signals_blocked.hpp"

namespace lk::emulator {
namespace {

/// Time to collect lines: one write per frame would cost more than the frame.
constexpr auto kGather = std::chrono::milliseconds(10);

}  // namespace

LogWriter::LogWriter(std::array<Descriptor, kFiles> files, OnEnd on_end, std::size_t most_waiting)
    : files_(std::move(files)), on_end_(std::move(on_end)), most_waiting_(most_waiting) {
  const SignalsBlocked blocked;
  thread_ = std::thread([this] { run(); });
}

LogWriter::~LogWriter() {
  finish("");
  thread_.join();
}

void LogWriter::finish(std::string last_lines) {
  {
    const std::lock_guard lock(mutex_);
    if (stop_) return;
    stop_ = true;
    last_lines_ = std::move(last_lines);
  }
  changed_.notify_one();
}

bool LogWriter::done() const {
  const std::lock_guard lock(mutex_);
  return done_;
}

void LogWriter::add(std::size_t log, std::string_view line) {
  bool too_slow = false;
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    if (failed_ || stop_) return;
    too_slow = failed_ = waiting_bytes_ + line.size() >= most_waiting_;
    if (!too_slow) {
      first = waiting_bytes_ == 0;
      waiting_bytes_ += line.size() + 1;
      waiting_[log].append(line) += '\n';
    }
  }
  if (first) changed_.notify_one();
  if (too_slow) on_end_("the disk is too slow");
}

bool LogWriter::failed() const {
  const std::lock_guard lock(mutex_);
  return failed_;
}

int LogWriter::write(const Batch& batch) {
  for (std::size_t n = 0; n < kFiles; ++n) {
    const int error = write_all(files_[n].get(), batch[n]);
    if (error != 0) return error;
  }
  return 0;
}

void LogWriter::run() {
  bool refused = false;  // after an error, nothing more may be written
  std::unique_lock lock(mutex_);
  while (!done_) {
    changed_.wait(lock, [this] { return stop_ || waiting_bytes_ > 0; });
    changed_.wait_for(lock, kGather, [this] { return stop_; });
    const bool last = stop_;
    const auto batch = std::exchange(waiting_, {});
    waiting_bytes_ = 0;
    const bool whole = !failed_;
    lock.unlock();
    int error = refused ? 0 : write(batch);
    if (error == 0 && last && whole) error = write_all(files_[0].get(), last_lines_);
    refused = refused || error != 0;
    lock.lock();
    if (error != 0 && !std::exchange(failed_, true)) {
      lock.unlock();
      on_end_(std::generic_category().message(error));
      lock.lock();
    }
    done_ = last;
  }
}

}  // namespace lk::emulator

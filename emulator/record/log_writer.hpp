#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

/// Writes the lines of two logs on a thread of its own, so that nobody waits for the disk. What a
/// kill leaves of the second log never runs ahead of the first.
class LogWriter {
 public:
  /// Limit of unwritten bytes: about 300 000 frames, half a minute of a full bus.
  static constexpr std::size_t kMostWaiting = std::size_t{16} << 20U;

  /// Called once, on any thread, with the reason why nothing more is written.
  using OnEnd = std::function<void(const std::string& reason)>;

  static constexpr std::size_t kFiles = 2;

  LogWriter(std::array<Descriptor, kFiles> files, OnEnd on_end,
            std::size_t most_waiting = kMostWaiting);
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  /// Waits until everything is written or has failed.
  ~LogWriter();

  /// Ends the logs without waiting: after the remaining lines, `last_lines` go to the first log.
  void finish(std::string last_lines);
  /// Finished, and everything is written.
  bool done() const;

  /// Adds a line and its end; never waits.
  void add(std::size_t log, std::string_view line);
  /// Returns true after an error.
  bool failed() const;

 private:
  using Batch = std::array<std::string, kFiles>;  // lines of each log, with their ends

  void run();
  /// Appends to the first file before it appends to the second. Returns 0 or errno.
  int write(const Batch& batch);

  std::array<Descriptor, kFiles> files_;
  OnEnd on_end_;
  std::size_t most_waiting_;
  mutable std::mutex mutex_;  // protects all members below
  std::condition_variable changed_;
  Batch waiting_;
  std::size_t waiting_bytes_ = 0;
  bool failed_ = false;
  bool stop_ = false;
  bool done_ = false;
  std::string last_lines_;
  std::thread thread_;
};

}  // namespace lk::emulator

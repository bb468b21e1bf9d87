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
  /// What waits for the disk at most: some 300 000 frames, half a minute of a full bus.
  static constexpr std::size_t kMostWaiting = std::size_t{16} << 20U;

  /// Called once, on any thread, when it cannot go on, with the reason; nothing is written then.
  using OnEnd = std::function<void(const std::string& reason)>;

  static constexpr std::size_t kFiles = 2;

  LogWriter(std::array<Descriptor, kFiles> files, OnEnd on_end,
            std::size_t most_waiting = kMostWaiting);
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  /// Waits until all is written, or cannot be.
  ~LogWriter();

  /// Nothing will be added any more. Once all is written, so are these lines of the first log,
  /// which say so. Does not wait either.
  void finish(std::string last_lines);
  /// Finished, and nothing is left to write.
  bool done() const;

  /// Never waits. The end of the line is added.
  void add(std::size_t log, std::string_view line);
  /// It could not go on.
  bool failed() const;

 private:
  using Batch = std::array<std::string, kFiles>;  // lines of each log, with their ends

  void run();
  /// Appends to the first file before it appends to the second. Returns 0 or errno.
  int write(const Batch& batch);

  std::array<Descriptor, kFiles> files_;
  OnEnd on_end_;
  std::size_t most_waiting_;
  mutable std::mutex mutex_;  // of all below
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

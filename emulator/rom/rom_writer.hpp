#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "emulator/config/rom_file.hpp"
#include "emulator/core/rom_write.hpp"

namespace lk::emulator {

/// ROM file of one drive.
struct RomPlace {
  int directory_fd = -1;
  std::string name;
  std::size_t bus = 0;  // its index
  RomOwner owner;
};

/// Writes ROM files on its own thread, so that no caller waits for the disk. Pending writes of one
/// drive are merged: the last one counts. The first write starts the thread, as most runs have
/// none. If that fails, it counts as a disk error.
class RomWriter {
 public:
  /// Returns 0 or errno. Default: write_durably; tests replace it.
  using WriteFile =
      std::function<int(int directory_fd, const std::string& name, const std::string& text)>;
  /// Called on the writer's thread when `write` and earlier ones of that drive are durable or have
  /// failed with `error`. Without a thread, called from `write`.
  using OnWritten = std::function<void(const RomPlace& place, const RomWrite& write, int error)>;

  explicit RomWriter(OnWritten on_written, WriteFile write_file = write_to_disk());
  RomWriter(const RomWriter&) = delete;
  RomWriter& operator=(const RomWriter&) = delete;
  /// Waits for the write in progress; drops pending ones.
  ~RomWriter();

  /// `place` identifies the drive and must outlive the writer.
  void write(const RomPlace& place, const RomWrite& write);

 private:
  static WriteFile write_to_disk();
  /// Returns 0 or errno.
  int start();
  void run();

  OnWritten on_written_;
  WriteFile write_file_;
  std::mutex mutex_;  // protects all members below
  std::condition_variable changed_;
  std::map<const RomPlace*, RomWrite> waiting_;
  std::deque<const RomPlace*> order_;  // pending drives, in order
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace lk::emulator

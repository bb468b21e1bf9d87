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

/// The file that keeps the ROM of one drive.
struct RomPlace {
  int directory_fd = -1;
  std::string name;
  std::size_t bus = 0;  // its index
  RomOwner owner;
};

/// Writes ROM files on a thread of its own, so that nobody waits for the disk. Writes of one drive
/// that pile up meanwhile become one: the last. The thread begins with the first write, as most
/// runs have none; a system that has no thread to give is a disk that refuses.
class RomWriter {
 public:
  /// Returns 0 or errno; write_durably, or what a test has instead.
  using WriteFile =
      std::function<int(int directory_fd, const std::string& name, const std::string& text)>;
  /// Called on the writer's thread when `write`, and all that came before it from that drive, has
  /// become durable, or has failed with `error`. Where there is no thread, from `write`.
  using OnWritten = std::function<void(const RomPlace& place, const RomWrite& write, int error)>;

  explicit RomWriter(OnWritten on_written, WriteFile write_file = write_to_disk());
  RomWriter(const RomWriter&) = delete;
  RomWriter& operator=(const RomWriter&) = delete;
  /// Waits for the write that is on its way, and forgets those that are not.
  ~RomWriter();

  /// `place` must outlive the writer, and stands for the drive.
  void write(const RomPlace& place, const RomWrite& write);

 private:
  static WriteFile write_to_disk();
  /// Returns 0 or errno.
  int start();
  void run();

  OnWritten on_written_;
  WriteFile write_file_;
  std::mutex mutex_;  // of all below
  std::condition_variable changed_;
  std::map<const RomPlace*, RomWrite> waiting_;
  std::deque<const RomPlace*> order_;  // whose turn it is
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace lk::emulator

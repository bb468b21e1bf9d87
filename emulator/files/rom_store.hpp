#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "emulator/config/rom_file.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/rom_write.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

/// Where and how the ROM of all drives is stored.
struct RomOptions {
  // Absent: one directory per bus in the user's state directory.
  std::optional<std::filesystem::path> directory;
  bool in_memory = false;  // do not save
  bool wipe = false;       // start from factory state
};

/// ROM file of one drive.
struct RomFile {
  int directory_fd = -1;
  std::string name;
  std::size_t bus = 0;  // index of the bus
  RomOwner owner;
};

/// Writes ROM files on its own thread, so that no caller waits for the disk. Of several pending
/// writes of one drive, it executes only the last. The first write starts the thread, as most runs
/// have no writes. If the thread cannot start, the write fails as if the disk had failed.
class RomWriter {
 public:
  /// Writes a file; returns 0 or errno. Default: `write_to_disk`; tests replace it.
  using WriteFile =
      std::function<int(int directory_fd, const std::string& name, const std::string& text)>;
  /// Called on the writer's thread when `write` and earlier ones of that drive are durable or have
  /// failed with `error`. If the thread cannot start, called from `RomWriter::write`.
  using OnWritten = std::function<void(const RomFile& place, const RomWrite& write, int error)>;

  explicit RomWriter(OnWritten on_written, WriteFile write_file = write_to_disk());
  RomWriter(const RomWriter&) = delete;
  RomWriter& operator=(const RomWriter&) = delete;
  /// Waits for the write in progress; drops pending writes.
  ~RomWriter();

  /// Queues a write of the drive's ROM file. `place` identifies the drive and must outlive the
  /// writer.
  void write(const RomFile& place, const RomWrite& write);

 private:
  static WriteFile write_to_disk();
  /// Starts the thread unless it runs. Returns 0 or errno.
  int start();
  void run();

  OnWritten on_written_;
  WriteFile write_file_;
  std::mutex mutex_;  // protects waiting_, order_ and stop_
  std::condition_variable changed_;
  std::map<const RomFile*, RomWrite> waiting_;
  std::deque<const RomFile*> order_;  // drives with a pending write, oldest first
  bool stop_ = false;
  std::thread thread_;
};

/// A directory of ROM files, locked by this process during the object's life.
class RomDirectory {
 public:
  /// Creates `path` if missing, and locks it. Throws StartError, with `advice` appended if the
  /// directory is unusable.
  RomDirectory(const std::filesystem::path& path, const std::string& advice);

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return directory_.get(); }

 private:
  void lock();

  std::filesystem::path path_;
  Descriptor directory_;
  Descriptor lock_;  // the kernel releases the lock when the process ends, however it ends
};

/// ROM files of all drives of this run.
class RomStore {
 public:
  /// Locks the directories. Loads the files into `buses`, except with RomOptions::wipe. Throws
  /// StartError.
  RomStore(const RomOptions& options, std::vector<BusConfig>& buses);
  /// Removes the ROM files of all drives of this run. Throws StartError.
  void wipe();

  /// Returns the ROM file of drive `id` on the bus with index `bus`.
  const RomFile& place(std::size_t bus, int id) const { return places_.at({bus, id}); }

 private:
  void take_directories(const RomOptions& options, const std::vector<BusConfig>& buses);
  const RomDirectory& directory_of(std::size_t bus) const {
    return directories_[directories_.size() == 1 ? 0 : bus];
  }

  std::deque<RomDirectory> directories_;                   // one, or one for each bus
  std::map<std::pair<std::size_t, int>, RomFile> places_;  // by bus and id
};

/// Loads the files into `buses` as RomStore does, but changes nothing on the disk. Throws
/// StartError.
void load_rom_read_only(const RomOptions& options, std::vector<BusConfig>& buses);

/// Returns the directory in which the user has one ROM directory per bus; empty if neither argument
/// is an absolute path. Follows the XDG Base Directory Specification.
std::filesystem::path state_directory(const char* xdg_state_home, const char* home);

/// Holds replies of a bus until the disk has stored the ROM. A reply that acknowledges a ROM write
/// is released when the write is durable. Later replies of the same drive wait behind it; replies
/// of other drives do not. The core has fixed the contents and the simulated time of a reply
/// before.
class RomGate {
 public:
  /// Limit of held replies per drive; further ones are dropped, as they would reach the host too
  /// late.
  static constexpr std::size_t kMaxHeld = 1024;

  /// ROM contents of a drive that are known to be durable.
  struct Kept {
    Registers rom;
    RomWear wear{};
  };

  explicit RomGate(const BusConfig& bus);

  /// Notes that `write` is pending.
  void begin(const RomWrite& write) { drives_.at(write.id).begun = write.number; }
  /// Takes a reply that is due: appends it to `out`, or holds it if it must wait.
  void pass(const TimedFrame& reply, std::vector<protocol::Frame>& out);
  /// Notes that `write` and earlier writes of its drive are durable, or have failed. Appends the
  /// replies that this releases to `out`. If the write failed and no later one is pending, returns
  /// the contents to which the drive's ROM must be restored; else null.
  const Kept* settle(const RomWrite& write, bool durable, std::vector<protocol::Frame>& out);

  /// Number of drives with a pending write.
  std::size_t waiting() const;
  bool idle() const { return waiting() == 0; }
  std::uint64_t failed_writes() const { return failed_writes_; }
  /// Replies dropped because their write failed or too many waited.
  std::uint64_t lost_replies() const { return lost_replies_; }

 private:
  /// The writes `after` < number <= `last`.
  struct Range {
    std::uint64_t after;
    std::uint64_t last;
  };
  struct Drive {
    Kept kept;
    std::uint64_t begun = 0;
    std::uint64_t settled = 0;
    std::deque<Range> failed;  // failed writes; removed when a reply acknowledges a later write
    std::deque<TimedFrame> held;
  };

  void release(Drive& drive, const TimedFrame& reply, std::vector<protocol::Frame>& out);

  std::map<int, Drive> drives_;  // by ID
  std::uint64_t failed_writes_ = 0;
  std::uint64_t lost_replies_ = 0;
};

}  // namespace lk::emulator

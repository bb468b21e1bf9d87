#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "emulator/config/rom_file.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/rom/rom_options.hpp"
#include "emulator/rom/rom_writer.hpp"

namespace lk::emulator {

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
  Descriptor lock_;  // the kernel releases it whenever the process ends
};

/// ROM files of all drives of this run.
class RomStore {
 public:
  /// Locks the directories and loads the files into `buses`, unless they will be wiped. Throws
  /// StartError.
  RomStore(const RomOptions& options, std::vector<BusConfig>& buses);
  /// Removes the ROM files of all drives of this run. Throws StartError.
  void wipe();

  /// Returns the ROM file of drive `id` on the bus with index `bus`.
  const RomPlace& place(std::size_t bus, int id) const { return places_.at({bus, id}); }

 private:
  void take_directories(const RomOptions& options, const std::vector<BusConfig>& buses);
  const RomDirectory& directory_of(std::size_t bus) const {
    return directories_[directories_.size() == 1 ? 0 : bus];
  }

  std::deque<RomDirectory> directories_;                    // one, or one for each bus
  std::map<std::pair<std::size_t, int>, RomPlace> places_;  // by bus and id
};

/// Loads the files into `buses` as RomStore does, but changes nothing on the disk. Throws
/// StartError.
void peek_rom(const RomOptions& options, std::vector<BusConfig>& buses);

/// Returns the user's ROM directory without the bus; empty if none. Follows the XDG Base Directory
/// Specification.
std::filesystem::path state_directory(const char* xdg_state_home, const char* home);

}  // namespace lk::emulator

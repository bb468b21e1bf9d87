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

/// A directory of ROM files, for this process alone as long as this lives.
class RomDirectory {
 public:
  /// Makes `path` if need be and locks it. Throws StartError, which ends in `advice` where the
  /// directory cannot be used at all.
  RomDirectory(const std::filesystem::path& path, const std::string& advice);

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return directory_.get(); }

 private:
  void lock();

  std::filesystem::path path_;
  Descriptor directory_;
  Descriptor lock_;  // the kernel lets go of it when the process ends, however it does
};

/// The ROM files of all drives of this run.
class RomStore {
 public:
  /// Takes the directories and puts what their files hold over `buses`, unless they are to be
  /// wiped. Throws StartError.
  RomStore(const RomOptions& options, std::vector<BusConfig>& buses);
  /// Removes the files of the drives of this run, for good. Throws StartError.
  void wipe();

  /// Where the ROM of the drive `id` on the bus with index `bus` goes.
  const RomPlace& place(std::size_t bus, int id) const { return places_.at({bus, id}); }

 private:
  void take_directories(const RomOptions& options, const std::vector<BusConfig>& buses);
  const RomDirectory& directory_of(std::size_t bus) const {
    return directories_[directories_.size() == 1 ? 0 : bus];
  }

  std::deque<RomDirectory> directories_;                    // one, or one for each bus
  std::map<std::pair<std::size_t, int>, RomPlace> places_;  // by bus and id
};

/// Puts what their files hold over `buses`, as RomStore does, and leaves the disk as it is: for
/// those who only want to see. Throws StartError.
void peek_rom(const RomOptions& options, std::vector<BusConfig>& buses);

/// The user's directory for ROM, without the bus; empty when there is none. From what the
/// environment says, see the XDG Base Directory Specification.
std::filesystem::path state_directory(const char* xdg_state_home, const char* home);

}  // namespace lk::emulator

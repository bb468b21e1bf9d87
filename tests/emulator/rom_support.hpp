#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "emulator/core/rom_write.hpp"

namespace lk::emulator {

/// A directory of the test's own, gone after it.
class TempDirectory {
 public:
  TempDirectory() {
    std::string name = testing::TempDir() + "lk-emu-rom-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
    path_ = name;
  }
  TempDirectory(const TempDirectory&) = delete;
  TempDirectory& operator=(const TempDirectory&) = delete;
  ~TempDirectory() { std::filesystem::remove_all(path_); }

  const std::filesystem::path& path() const { return path_; }
  std::string text_of(const std::string& name) const {
    std::stringstream text;
    text << std::ifstream(path_ / name).rdbuf();
    return text.str();
  }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
  }
  std::set<std::string> names() const {
    std::set<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      all.insert(entry.path().filename().string());
    }
    return all;
  }

 private:
  std::filesystem::path path_;
};

/// The `number`-th write of the drive `id`; what it writes is told by its number.
inline RomWrite rom_write(int id, std::uint64_t number) {
  RomWrite write;
  write.number = number;
  write.id = id;
  write.rom.encoder_offset = static_cast<std::uint16_t>(number);
  write.wear[static_cast<std::size_t>(RomParameter::kEncoderOffset)] =
      static_cast<std::uint32_t>(number);
  return write;
}

}  // namespace lk::emulator

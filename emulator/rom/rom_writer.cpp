#include "emulator/rom/rom_writer.hpp"

#include <set>
#include <system_error>
#include <utility>

#include "emulator/files/durable_file.hpp"
#include "emulator/files/signals_blocked.hpp"

namespace lk::emulator {
/// The first write also syncs the directory, as a file is only as durable as its directory.
RomWriter::WriteFile RomWriter::write_to_disk() {
  return [durable = std::set<int>()](int directory_fd, const std::string& name,
                                     const std::string& text) mutable {
    int error = durable.contains(directory_fd) ? 0 : sync_entry(directory_fd);
    if (error == 0) {
      durable.insert(directory_fd);
      error = write_durably(directory_fd, name, text);
    }
    return error;
  };
}

RomWriter::RomWriter(OnWritten on_written, WriteFile write_file)
    : on_written_(std::move(on_written)), write_file_(std::move(write_file)) {}

RomWriter::~RomWriter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RomWriter::write(const RomPlace& place, const RomWrite& write) {
  if (const int error = start(); error != 0) {
    on_written_(place, write, error);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.insert_or_assign(&place, write).second) order_.push_back(&place);
  }
  changed_.notify_one();
}

int RomWriter::start() {
  if (thread_.joinable()) return 0;
  try {
    const SignalsBlocked blocked;
    thread_ = std::thread([this] { run(); });
    return 0;
  } catch (const std::system_error& problem) {
    return problem.code().value();
  }
}

void RomWriter::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !order_.empty(); });
    if (stop_) return;
    const RomPlace& place = *order_.front();
    order_.pop_front();
    const RomWrite write = waiting_[&place];
    waiting_.erase(&place);
    lock.unlock();
    const int error =
        write_file_(place.directory_fd, place.name, print_rom(place.owner, write.rom, write.wear));
    on_written_(place, write, error);
    lock.lock();
  }
}

}  // namespace lk::emulator

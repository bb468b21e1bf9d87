#include "emulator/rom/rom_writer.hpp"

#include <csignal>
#include <set>
#include <utility>

#include "emulator/rom/durable_file.hpp"

namespace lk::emulator {
namespace {

/// Signals are for the loop's thread; threads inherit what their maker blocks.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

}  // namespace

/// A file is as durable as its directory: with the first one that is made sure of as well.
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
    : on_written_(std::move(on_written)), write_file_(std::move(write_file)) {
  const SignalsBlocked blocked;
  thread_ = std::thread([this] { run(); });
}

RomWriter::~RomWriter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void RomWriter::write(const RomPlace& place, const RomWrite& write) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.insert_or_assign(&place, write).second) order_.push_back(&place);
  }
  changed_.notify_one();
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

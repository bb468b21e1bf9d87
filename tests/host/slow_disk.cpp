// Preloaded (LD_PRELOAD) to slow the disk down: fsync waits for a byte from the FIFO
// LKEMU_SLOW_DISK, and so does a write to the file LKEMU_SLOW_FILE.

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>

namespace {

void wait_for_a_byte() {
  static const int fifo = [] {
    static_cast<void>(::syscall(SYS_write, STDERR_FILENO, "writing\n", 8));
    return ::open(std::getenv("LKEMU_SLOW_DISK"), O_RDONLY | O_CLOEXEC);
  }();
  char byte = 0;
  static_cast<void>(::read(fifo, &byte, 1) == 1);
}

bool is_slow_file(int fd) {
  const char* const name = std::getenv("LKEMU_SLOW_FILE");
  struct stat slow {};
  struct stat written {};
  return name != nullptr && ::stat(name, &slow) == 0 && ::fstat(fd, &written) == 0 &&
         slow.st_ino == written.st_ino && slow.st_dev == written.st_dev;
}

}  // namespace

extern "C" int fsync(int fd) {
  wait_for_a_byte();
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name): the system's are reserved
extern "C" ssize_t write(int fd, const void* bytes, size_t size) {
  if (is_slow_file(fd)) wait_for_a_byte();
  return ::syscall(SYS_write, fd, bytes, size);
}

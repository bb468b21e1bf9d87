// Loaded before libc (LD_PRELOAD), makes the disk slow: fsync waits for a byte from the FIFO that
// LKEMU_SLOW_DISK names.

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>

extern "C" int fsync(int fd) {
  static const int fifo = [] {
    static_cast<void>(::write(STDERR_FILENO, "writing\n", 8));
    return ::open(std::getenv("LKEMU_SLOW_DISK"), O_RDONLY | O_CLOEXEC);
  }();
  char byte = 0;
  static_cast<void>(::read(fifo, &byte, 1));
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

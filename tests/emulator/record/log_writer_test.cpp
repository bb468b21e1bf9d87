// A full or blocked disk affects only the log.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "emulator/monitor/record/recorder.hpp"
#include "tests/support/no_threads.hpp"

namespace lk::emulator {
namespace log_writer_test {

TEST(LogWriter, StopsOnAFullDiskAndReportsItOnce) {
  std::array files = {Descriptor(::open("/dev/full", O_WRONLY)),
                      Descriptor(::open("/dev/full", O_WRONLY))};
  std::vector<std::string> said;
  {
    LogWriter writer(std::move(files), [&](const std::string& reason) { said.push_back(reason); });
    for (int n = 0; n < 1000; ++n) writer.add(1, "line");
    writer.finish("last\n");
  }
  EXPECT_EQ(said, std::vector<std::string>{"No space left on device"});
}

TEST(LogWriter, NeverWaitsForASlowDisk) {
  // A pipe without a reader acts as a blocked disk.
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  std::vector<std::string> said;
  auto reader = std::make_unique<Descriptor>(ends[0]);
  {
    std::array files = {Descriptor(ends[1]), Descriptor(::open("/dev/null", O_WRONLY))};
    constexpr std::size_t kMax = 1 << 20;
    LogWriter writer(
        std::move(files), [&](const std::string& r) { said.push_back(r); }, kMax);
    const std::string line(1000, 'x');
    while (!writer.failed()) writer.add(0, line);  // must not block
    EXPECT_FALSE(writer.done());
    reader.reset();  // the disk fails
  }
  EXPECT_EQ(said, std::vector<std::string>{"the disk is too slow"});
}

TEST(LogWriter, RestoresTheSignalMaskIfThreadCreationFails) {
  const test::NoThreads none;
  std::array files = {Descriptor(::open("/dev/null", O_WRONLY)),
                      Descriptor(::open("/dev/null", O_WRONLY))};
  EXPECT_THROW(LogWriter(std::move(files), [](const std::string&) {}), std::system_error);
  sigset_t blocked;
  ASSERT_EQ(::pthread_sigmask(SIG_SETMASK, nullptr, &blocked), 0);
  for (const int signal : {SIGTERM, SIGINT}) EXPECT_EQ(sigismember(&blocked, signal), 0) << signal;
}

}  // namespace log_writer_test
}  // namespace lk::emulator

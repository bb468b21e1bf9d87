// Kills during ROM writes on SocketCAN; tests/host has ten times as many.

#include "tests/host/kill_support.hpp"

namespace lk::host {
namespace kill_test {

constexpr int kKillsEach = 15;

TEST(Kill, OnSocketCanLosesNoAcknowledgedWrite) {
  {
    const test::TempDirectory on_disk;
    kill::until_killed(kKillsEach, "vcan0", on_disk.path().string(), kill::kMaxOnDisk, 20);
  }
  const test::TempDirectory in_memory;
  ASSERT_TRUE(run("mount -t tmpfs -o mode=755 none " + in_memory.path().string()));
  kill::until_killed(kKillsEach, "vcan0", in_memory.path().string(), kill::kMaxInMemory, 21);
  EXPECT_TRUE(run("umount " + in_memory.path().string()));
}

}  // namespace kill_test
}  // namespace lk::host

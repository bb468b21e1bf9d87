// Kills during ROM writes: on a disk, where kills hit waiting writes, and in memory, with many
// writes between two kills.

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "tests/host/kill_support.hpp"

namespace lk::host {
namespace kill_test {

constexpr int kKillsEach = 100;

TEST(Kill, AtAnyInstantLosesNoAcknowledgedWrite) {
  const test::TempDirectory own;
  kill::until_killed(kKillsEach, own_bus(), own.path().string(), kill::kMaxOnDisk, 20);
}

class KillInMemory : public testing::TestWithParam<unsigned> {};

TEST_P(KillInMemory, LosesNoAcknowledgedWrite) {
  std::string directory = "/dev/shm/lk-test-XXXXXX";
  if (::mkdtemp(directory.data()) == nullptr) GTEST_SKIP() << "no file system in memory";
  kill::until_killed(kKillsEach, own_bus(), directory, kill::kMaxInMemory, GetParam());
  std::filesystem::remove_all(directory);
}

INSTANTIATE_TEST_SUITE_P(Seeds, KillInMemory, testing::Values(21U, 22U));

}  // namespace kill_test
}  // namespace lk::host

// The tick allocates no memory. A separate program, because it replaces operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>

#include "tests/model/mixed_run.hpp"

namespace {
std::atomic<long> allocations = 0;

void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* memory =
      alignment <= alignof(std::max_align_t)
          ? std::malloc(size)
          : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}
}  // namespace

void* operator new(std::size_t size) { return counted(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace lk::model::test {
namespace {

TEST(Allocation, CountsAllocations) {
  const long before = allocations;
  const auto bank = std::make_unique<DriveBank>(std::vector<DriveInit>{mixed_drive(0)});
  EXPECT_GT(allocations, before);
}

TEST(Allocation, RunningDrivesDoNotAllocate) {
  for (const std::size_t count : {1U, 13U}) {
    std::vector<DriveInit> inits;
    for (std::size_t n = 0; n < count; ++n) {
      inits.push_back(mixed_drive(static_cast<int>(n)));
    }
    DriveBank bank(inits);
    double sum = 0.0;
    const long before = allocations;
    for (int stretch = 0; stretch < kStretches; ++stretch) {
      for (std::size_t n = 0; n < count; ++n) {
        direct(bank, n, static_cast<int>(n), stretch);
        bank.feed_input(n);
        bank.configure(n, inits[n].settings);
      }
      bank.advance(kStretchTicks);
      for (std::size_t n = 0; n < count; ++n) {
        sum += bank.telemetry(n).i_q + bank.truth(n).i_q + bank.energy(n).copper;
      }
    }
    EXPECT_EQ(allocations, before) << count << " drives";
    EXPECT_TRUE(std::isfinite(sum));
  }
}

}  // namespace
}  // namespace lk::model::test

// The way of a frame allocates nothing once the bus runs: a program of its own, for it counts every
// allocation there is.

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "tests/support/test_bus.hpp"

namespace {
std::size_t allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

std::size_t allocations_while_polling(std::int64_t bitrate) {
  Bus bus(test::bus_config({1, 2, 3, 4}, bitrate));
  std::vector<TimedFrame> replies;
  replies.reserve(100);
  std::vector<RomWrite> rom_writes;
  const auto poll = [&](int cycles) {
    for (int k = 0; k < cycles; ++k) {
      for (const auto& row : protocol::kOpcodes) {
        protocol::Frame query;
        query.id = 0x141U + static_cast<std::uint32_t>(k % 4);
        query.data[0] = static_cast<std::uint8_t>(row.opcode);
        bus.receive({bus.time(), query});
      }
      bus.advance_to(bus.time() + 10ms);
      bus.take_replies(replies);
      replies.clear();
      bus.take_rom_writes(rom_writes);
      rom_writes.clear();
    }
  };
  poll(10);
  const std::size_t before = allocations;
  poll(100);
  return allocations - before;
}

TEST(Allocation, NoneWhilePolling) {
  EXPECT_EQ(allocations_while_polling(1'000'000), 0U);
  EXPECT_EQ(allocations_while_polling(0), 0U);
}

}  // namespace
}  // namespace lk::emulator

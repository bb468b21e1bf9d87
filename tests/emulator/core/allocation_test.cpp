// A frame causes no allocations once the bus runs. A separate program, because it counts all
// allocations.

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "emulator/monitor/advice/adviser.hpp"
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
      for (const auto& row : protocol::commands()) {
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

/// Number of allocations for frames of all kinds, to present drives and an absent one.
std::size_t allocations_of_advice(Adviser& adviser, int frames) {
  const std::size_t before = allocations;
  std::uint32_t random = 1;
  const auto next = [&random] { return random = random * 1664525 + 1013904223; };
  for (int n = 0; n < frames; ++n) {
    protocol::Frame frame;
    frame.id = next() % 8 == 0 ? 0x280 : 0x140 + next() % 4;
    frame.dlc = next() % 7 == 0 ? 3 : 8;
    const auto& known = protocol::commands()[(next() >> 16U) % protocol::commands().size()];
    for (std::size_t k = 0; k < 8; ++k) frame.data[k] = static_cast<std::uint8_t>(next() >> 24U);
    if (n % 2 == 0) frame.data[0] = static_cast<std::uint8_t>(known.opcode);
    adviser.on_query({adviser.query_count() * 100us, frame});
  }
  return allocations - before;
}

TEST(Allocation, AdviserStopsAllocatingOnceItsAdviceIsComplete) {
  Adviser adviser(test::bus_config({1, 2}, 1'000'000));
  EXPECT_GT(allocations_of_advice(adviser, 200'000), 0U) << "each advice is kept";
  EXPECT_EQ(allocations_of_advice(adviser, 200'000), 0U);
  EXPECT_LE(adviser.advice().size(), 3 * kAdviceKinds);
}

}  // namespace
}  // namespace lk::emulator

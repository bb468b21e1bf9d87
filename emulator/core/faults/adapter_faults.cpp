// Faults of the adapter between hosts and bus: times added to the configured ones.

#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_rows.hpp"
#include "emulator/core/wire/host_adapter.hpp"

namespace lk::emulator {
namespace {

using enum FaultGroup;

constexpr std::string_view kNoYes[] = {"no", "yes"};
enum class Report : std::uint8_t { kNo, kYes };

void add_latency(const LiveFault& live, AdapterTimes& sum) {
  sum = add(sum, {.tx_us = live.number(0),
                  .rx_us = live.number(1),
                  .jitter_us = live.number(2),
                  .tail_us = live.number(3),
                  .tail_probability = live.number(4)});
}

void add_batch(const LiveFault& live, AdapterTimes& sum) {
  sum = add(sum,
            {.batch_us = live.number(0), .batch_most = static_cast<std::size_t>(live.number(1))});
}

void add_overrun(const LiveFault& live, AdapterTimes& sum) {
  sum = add(sum, {.depth = static_cast<std::size_t>(live.number(0)),
                  .reports_overrun = live.choice<Report>(1) == Report::kYes});
}

void add_stalls(const LiveFault& live, AdapterTimes& sum) {
  sum =
      add(sum, {.stall_every = static_cast<int>(live.number(0)), .stall_us = live.number(1) * 1e3});
}

// Row: word, group and parameters, functions; description.
// clang-format off
constexpr FaultRow kAdapterRows[] = {
    {.word = "adapter_latency", .group = kLink, .params = {needed("tx_us", 0, 1'000'000), needed("rx_us", 0, 1'000'000), number("jitter_us", 0, 1'000'000, 0), number("tail_us", 0, 1'000'000, 0), number("tail_probability", 0, 1, 0)},
     .of_bus = true, .adapter = add_latency, .adapter_shows = &AdapterShown::late,
     .about = {"the hosts' adapter takes so long to the wire and to the host, by up to the jitter less or more, and now and then by the tail more", "主机的适配器到总线、到主机各要这么久，上下浮动不超过 jitter，偶尔再加上 tail"}},
    {.word = "adapter_batch", .group = kLink, .params = {number("every_us", 1, 1'000'000, 1000), count("most", 1, 1024, 64)},
     .of_bus = true, .adapter = add_batch, .adapter_shows = &AdapterShown::batched,
     .about = {"frames reach the host in bundles, at multiples of this time or when so many wait, with one time stamp", "帧成批到达主机：在这一时间的整数倍，或等待的达到这么多时；时间戳相同"}},
    {.word = "adapter_overrun", .group = kLink, .params = {count("depth", 1, 1024, 32), choice("flag", kNoYes, Report::kYes)},
     .of_bus = true, .adapter = add_overrun, .adapter_shows = &AdapterShown::lost,
     .about = {"no more than so many frames wait in the adapter for the host; newer ones are lost, and with the flag an error frame, RX overflow, says so", "适配器里最多有这么多帧等待主机；再来的丢掉，flag 为 yes 时有一个错误帧（RX overflow）说明"}},
    {.word = "write_stalls", .group = kLink, .params = {count("every", 1, 1000, 2), number("stall_ms", 0.01, 10'000, 5200)},
     .of_bus = true, .adapter = add_stalls, .adapter_shows = &AdapterShown::stalled,
     .about = {"while no drive answers, for 10 ms, each of so many writes of the host blocks this long; what it writes meanwhile waits behind", "10 ms 没有驱动器应答时，主机每这么多次写就有一次阻塞这么久；其间写的排在后面"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> adapter_faults() { return kAdapterRows; }

}  // namespace lk::emulator

#include "emulator/core/host_queue.hpp"

namespace lk::emulator {
namespace {

// clang-format off
constexpr HostQueue kQueues[] = {
    {.name = "default", .frames = HostQueue::kDefaultFrames, .full = QueueFull::kDropNewest},  // assumed: 120 ms of a full wire
    {.name = "socketcan", .frames = 10 + 3, .full = QueueFull::kRefuse},  // Linux: txqueuelen 10 of CAN devices; three mailboxes of a controller (assumed)
    {.name = "gs_usb", .frames = 10 + 10, .full = QueueFull::kRefuse},  // Linux: txqueuelen 10, and GS_MAX_TX_URBS 10 in gs_usb.c
    {.name = "slcan", .frames = 64, .full = QueueFull::kRefuse},  // assumed: buffer of an adapter's firmware
    {.name = "pi3hat", .frames = 3, .full = QueueFull::kDropNewest},  // a host's documentation: three slots
    {.name = "mcp2515", .frames = 10 + 1, .full = QueueFull::kRefuse},  // Linux: txqueuelen 10, and one frame at a time in mcp251x.c
};
// clang-format on

}  // namespace

std::span<const HostQueue> host_queues() { return kQueues; }

}  // namespace lk::emulator

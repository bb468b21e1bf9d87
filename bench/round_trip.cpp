// A host on a CAN bus that queries the state of 32 drives (0x9C) and measures. Independent of the
// emulator: an echo gets the same queries for comparison. bench/on_bus runs it.
//
// usage: round_trip INTERFACE trips N         one query at a time, N of them
//        round_trip INTERFACE rate N          as trips, but without reading the clock in between
//        round_trip INTERFACE pipelined N     up to 32 queries pending
//        round_trip INTERFACE hosts N         eight hosts at once, N queries each
//        round_trip INTERFACE sweeps N        N times all 32, with a full wire; compared with
//                                             the timing of a wire of 1 Mbit/s
//
// Prints one line of name=value.

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

namespace {

constexpr int kDrives = 32;
constexpr int kHosts = 8;
constexpr canid_t kFirst = 0x141;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

[[noreturn]] void give_up(const char* what) {
  std::perror(what);
  std::exit(2);
}

template <typename Value>
void set(int socket, int level, int name, const Value& value) {
  if (::setsockopt(socket, level, name, &value, sizeof value) < 0) give_up("setsockopt");
}

int open_bus(const char* interface) {
  const int bus = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface));
  if (::bind(bus, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
    give_up(interface);
  }
  set(bus, SOL_SOCKET, SO_RCVTIMEO, timeval{10, 0});  // then it counts as unanswered
  return bus;
}

can_frame query(int n) {
  can_frame frame{};
  frame.can_id = kFirst + static_cast<canid_t>(n % kDrives);
  frame.len = 8;
  frame.data[0] = 0x9C;
  return frame;
}

void send(int bus, int n) {
  const can_frame frame = query(n);
  if (::write(bus, &frame, sizeof frame) != sizeof frame) give_up("write");
}

bool receive(int bus, can_frame& frame) { return ::read(bus, &frame, sizeof frame) == CAN_MTU; }

bool answers(const can_frame& reply, int n) {
  return reply.can_id == kFirst + static_cast<canid_t>(n % kDrives) && reply.data[0] == 0x9C;
}

bool ask(int bus, int n) {
  can_frame reply{};
  send(bus, n);
  return receive(bus, reply) && answers(reply, n);
}

// --- one at a time, many at a time

void trips(int bus, int count) {
  std::vector<double> took_us;
  int unanswered = 0;
  for (int n = 0; n < count; ++n) {
    const auto start = Clock::now();
    if (!ask(bus, n)) ++unanswered;
    took_us.push_back(1e6 * seconds_since(start));
  }
  std::ranges::sort(took_us);
  std::printf("median_us=%.1f p99_us=%.1f unanswered=%d\n", took_us[took_us.size() / 2],
              took_us[took_us.size() * 99 / 100], unanswered);
}

void rate(int bus, int count) {
  const auto start = Clock::now();
  int unanswered = 0;
  for (int n = 0; n < count; ++n) unanswered += ask(bus, n) ? 0 : 1;
  std::printf("per_s=%.1f unanswered=%d\n", count / seconds_since(start), unanswered);
}

void pipelined(int bus, int count) {
  const auto start = Clock::now();
  int sent = 0;
  int answered = 0;
  for (can_frame reply{}; answered < count; ++answered) {
    for (; sent < count && sent < answered + kDrives; ++sent) send(bus, sent);
    if (!receive(bus, reply) || !answers(reply, answered)) break;
  }
  std::printf("per_s=%.1f unanswered=%d\n", answered / seconds_since(start), count - answered);
}

/// Each host has its own drives and receives only their frames.
int ask_own_drives(const char* interface, int host, int count) {
  const int bus = open_bus(interface);
  std::array<can_filter, kDrives / kHosts> own{};
  for (std::size_t k = 0; k < own.size(); ++k) {
    own[k] = {query(host + kHosts * static_cast<int>(k)).can_id, CAN_SFF_MASK};
  }
  set(bus, SOL_CAN_RAW, CAN_RAW_FILTER, own);
  // Discards frames that arrived before the filter was set.
  for (can_frame early{}; ::recv(bus, &early, sizeof early, MSG_DONTWAIT) > 0;) {
  }
  int unanswered = 0;
  for (int n = 0; n < count; ++n) unanswered += ask(bus, host + kHosts * n) ? 0 : 1;
  return unanswered;
}

void hosts(const char* interface, int count) {
  const auto start = Clock::now();
  for (int host = 0; host < kHosts; ++host) {
    const pid_t child = ::fork();
    if (child < 0) give_up("fork");
    if (child == 0) ::_exit(std::min(ask_own_drives(interface, host, count), 100));
  }
  int unanswered = 0;
  for (int status = 0; ::wait(&status) > 0;) {
    unanswered += WIFEXITED(status) ? WEXITSTATUS(status) : count;
  }
  std::printf("per_s=%.1f unanswered=%d\n", kHosts * count / seconds_since(start), unanswered);
}

// --- the wire

constexpr double kBit_us = 1;          // at 1 Mbit/s
constexpr double kReplyTime_us = 100;  // of a drive, after the last bit of the query
constexpr int kIntermission = 3;

/// Bits of a frame of 8 bytes from start to end by ISO 11898-1: stuffed from the start to the CRC,
/// then CRC delimiter, ACK, ACK delimiter, 7 bits of end.
int frame_bits(const can_frame& frame) {
  std::string bits = "0";
  const auto add = [&](unsigned value, int count) {
    while (count-- > 0) bits += ((value >> count) & 1U) != 0 ? '1' : '0';
  };
  add(frame.can_id, 11);
  add(0, 3);  // no remote frame, not extended, reserved
  add(frame.len, 4);
  for (int k = 0; k < frame.len; ++k) add(frame.data[k], 8);
  unsigned crc = 0;
  for (const char bit : bits) {
    const bool invert = (bit == '1') != ((crc & 0x4000U) != 0);
    crc = (crc << 1) & 0x7FFFU;
    if (invert) crc ^= 0x4599U;
  }
  add(crc, 15);
  int stuffed = 0;
  int run = 0;
  char last = 'x';
  for (const char bit : bits) {
    run = bit == last ? run + 1 : 1;
    last = bit;
    if (run == 5) {
      ++stuffed;
      last = bit == '0' ? '1' : '0';
      run = 1;
    }
  }
  return static_cast<int>(bits.size()) + stuffed + 10;
}

struct Seen {
  double at_us;
  can_frame frame;
};

/// Opens a socket that receives all frames, with the kernel's time stamps.
int open_monitor(const char* interface) {
  const int monitor = open_bus(interface);
  set(monitor, SOL_SOCKET, SO_RCVBUFFORCE, 8 << 20);
  set(monitor, SOL_SOCKET, SO_TIMESTAMPNS, 1);
  return monitor;
}

std::vector<Seen> received_by(int monitor, std::size_t count) {
  std::vector<Seen> all;
  while (all.size() < count) {
    Seen seen{};
    iovec vector{&seen.frame, sizeof seen.frame};
    alignas(cmsghdr) std::array<char, 64> control{};
    msghdr message{};
    message.msg_iov = &vector;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (::recvmsg(monitor, &message, 0) != CAN_MTU) break;
    timespec stamp{};
    if (const cmsghdr* item = CMSG_FIRSTHDR(&message)) {
      std::memcpy(&stamp, CMSG_DATA(item), sizeof stamp);
    }
    // Relative to a recent time, so that a double resolves less than a nanosecond.
    seen.at_us = static_cast<double>(stamp.tv_sec % 100'000) * 1e6 +
                 static_cast<double>(stamp.tv_nsec) * 1e-3;
    all.push_back(seen);
  }
  return all;
}

/// Compares with the earliest times that the wire allows, for any priority. Queries are first in,
/// first out: all queries up to a reply's own, and all earlier replies, were on the wire before it.
void judge(const std::vector<Seen>& all, int count) {
  std::vector<double> queries_us{0};  // time on the wire up to and including each
  std::vector<double> sent_us;
  double replies_us = 0;
  double least_lead_us = 1e9;
  std::array<std::size_t, kDrives> asked_before{};
  double last_us = 0;
  int replies = 0;
  std::vector<std::vector<std::size_t>> waiting(kDrives);  // queries without a reply, by drive
  for (const Seen& seen : all) {
    const auto drive = static_cast<std::size_t>(seen.frame.can_id - kFirst);
    const double bits = frame_bits(seen.frame);
    const bool is_query = std::all_of(seen.frame.data + 1, seen.frame.data + 8,
                                      [](std::uint8_t byte) { return byte == 0; });
    if (is_query) {
      queries_us.push_back(queries_us.back() + (bits + kIntermission) * kBit_us);
      sent_us.push_back(seen.at_us);
      waiting[drive].push_back(sent_us.size() - 1);
      continue;
    }
    const std::size_t of = waiting[drive].at(asked_before[drive]++);
    const double by_load = sent_us.front() + queries_us[of + 1] + replies_us + bits * kBit_us;
    const double alone =
        sent_us[of] + (frame_bits(query(static_cast<int>(of))) + bits) * kBit_us + kReplyTime_us;
    least_lead_us = std::min(least_lead_us, seen.at_us - std::max(by_load, alone));
    replies_us += (bits + kIntermission) * kBit_us;
    last_us = seen.at_us;
    ++replies;
  }
  const double wire_us = queries_us.back() + replies_us - kIntermission * kBit_us;
  const double took_us = last_us - sent_us.front();
  std::printf("sweeps_per_s=%.2f wire_allows=%.2f share=%.4f least_lead_us=%.1f unanswered=%d\n",
              1e6 * replies / kDrives / took_us, 1e6 * replies / kDrives / wire_us,
              wire_us / took_us, least_lead_us, count * kDrives - replies);
}

void sweeps(const char* interface, int bus, int count) {
  const int monitor = open_monitor(interface);
  const int all = count * kDrives;
  int sent = 0;
  int answered = 0;
  for (can_frame reply{}; answered < all; ++answered) {
    // Sends another sweep while less than one sweep is pending.
    if (sent < all && sent - answered <= kDrives) {
      for (int k = 0; k < kDrives; ++k) send(bus, sent++);
    }
    if (!receive(bus, reply)) break;
  }
  judge(received_by(monitor, static_cast<std::size_t>(sent) + static_cast<std::size_t>(answered)),
        count);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc == 4 ? argv[2] : "";
  const int count = argc == 4 ? static_cast<int>(std::strtol(argv[3], nullptr, 10)) : 0;
  if (count < 1) {
    std::fputs("usage: round_trip INTERFACE trips|rate|pipelined|hosts|sweeps COUNT\n", stderr);
    return 2;
  }
  if (what == "hosts") {
    hosts(argv[1], count);
    return 0;
  }
  const int bus = open_bus(argv[1]);
  if (what == "trips") trips(bus, count);
  if (what == "rate") rate(bus, count);
  if (what == "pipelined") pipelined(bus, count);
  if (what == "sweeps") sweeps(argv[1], bus, count);
  return 0;
}

// Effects of the machine on a running emulator: renamed interfaces, exhausted descriptors, changed
// clocks, a busy processor.

#include <sched.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/host/machine_support.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace machine_test {

// --- interfaces

class WatchedInterface : public MachineTest {
 protected:
  WatchedInterface() : MachineTest("vcanold") {}
  ~WatchedInterface() override {
    for (const char* name : {"vcanold", "vcannew"}) {
      run("ip link del " + std::string(name) + " 2>/dev/null");
    }
  }
  static void make(const std::string& name) {
    ASSERT_TRUE(run("ip link add " + name + " type vcan && ip link set " + name + " up"));
  }
  static void rename(const std::string& from, const std::string& to) {
    ASSERT_TRUE(run("ip link set " + from + " down && ip link set " + from + " name " + to +
                    " && ip link set " + to + " up"));
  }
  /// Sends queries to all four drives, several at a time; returns their number.
  static std::uint64_t send_queries() {
    constexpr std::uint64_t kQueries = 50;
    Host host("vcanold");
    for (canid_t n = 0; n < kQueries; ++n) host.send(0x141U + n % 4, kReadState2);
    return kQueries;
  }
  /// Expects the program to open a new interface as soon as `allow(pid)` ends what `prevent(pid)`
  /// has begun. No event reports that, so the program must poll.
  template <class Prevent, class Allow>
  void expect_to_open_later(Prevent prevent, Allow allow) const {
    make("vcanold");
    ReadyEmulator emulator(arguments());
    ASSERT_TRUE(run("ip link del vcanold"));
    ASSERT_TRUE(emulator.wait_for_log("vcanold is gone"));
    prevent(emulator.pid());
    make("vcanold");
    EXPECT_TRUE(emulator.wait_for_log("vcanold: cannot open: "));
    allow(emulator.pid());
    ASSERT_TRUE(emulator.wait_for_log("vcanold is up: continuing"));
    EXPECT_TRUE(Host("vcanold").query(1, kReadState2));
    const auto result = emulator.stop();
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(count_of(result.err, "cannot open"), 1) << result.err;
  }
  bool says(const std::string& what) const {
    return get("/status").body.find(what) != std::string::npos;
  }
  /// Returns whether this number of frames was received or lost by the kernel, with none pending.
  bool has_dealt_with(std::uint64_t frames) const {
    const Answer status = get("/status");
    return status.number("frames") + status.number("kernel_drops") >= static_cast<double>(frames) &&
           status.number("frames_waiting") + status.number("replies_waiting") == 0;
  }
};

TEST_F(WatchedInterface, IsLostWhenRenamed) {
  make("vcanold");
  ReadyEmulator emulator(arguments());
  rename("vcanold", "vcannew");
  ASSERT_TRUE(emulator.wait_for_log("vcanold was renamed to vcannew: waiting for a new vcanold"));
  {
    Host stranger("vcannew");
    stranger.send(0x141, kReadState2);
    ASSERT_EQ(get("/status").status, 200);  // the program has run since
    EXPECT_FALSE(stranger.receive(0)) << "nobody expects drives there";
  }
  make("vcanold");
  ASSERT_TRUE(emulator.wait_for_log("vcanold is up: continuing"));
  EXPECT_TRUE(Host("vcanold").query(1, kReadState2));
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST_F(WatchedInterface, RecoversWhenRenamedBack) {
  make("vcanold");
  ReadyEmulator emulator(arguments());
  rename("vcanold", "vcannew");
  ASSERT_TRUE(emulator.wait_for_log("vcanold was renamed to vcannew"));
  rename("vcannew", "vcanold");
  ASSERT_TRUE(emulator.wait_for_log("vcanold is up: continuing"));
  EXPECT_TRUE(Host("vcanold").query(1, kReadState2));
  EXPECT_EQ(count_of(emulator.stop().err, "was renamed to vcannew"), 1);
}

TEST_F(WatchedInterface, OpensOnceADescriptorIsFree) {
  rlimit before{};
  const rlimit none{3, 1024};  // fewer than it has open
  expect_to_open_later(
      [&](pid_t pid) { ASSERT_EQ(::prlimit(pid, RLIMIT_NOFILE, &none, &before), 0); },
      [&](pid_t pid) { ASSERT_EQ(::prlimit(pid, RLIMIT_NOFILE, &before, nullptr), 0); });
}

TEST_F(WatchedInterface, OpensOnceEpollAcceptsItsSocket) {
  if (!in_user_mode_linux()) GTEST_SKIP() << "would keep all of this machine from waiting";
  const std::string limit = "/proc/sys/fs/epoll/max_user_watches";
  const std::string before = text_of(limit);
  expect_to_open_later(
      [&](pid_t) { ASSERT_TRUE(run("echo 0 >" + limit)); },
      [&](pid_t) {
        ASSERT_TRUE(run("echo " + before.substr(0, before.find('\n')) + " >" + limit));
      });
}

/// While stopped it cannot answer before the interface is down; its socket keeps earlier frames.
TEST_F(WatchedInterface, CountsFramesLostWhileDown) {
  make("vcanold");
  ReadyEmulator emulator(arguments());
  constexpr int kRounds = 3;
  std::uint64_t sent = 0;
  for (int round = 0; round < kRounds; ++round) {
    ASSERT_TRUE(suspend(emulator));
    sent += send_queries();
    // It notices before its first answer or by it, so no answer can leave.
    ASSERT_TRUE(run("ip link set vcanold down"));
    emulator.signal(SIGCONT);
    ASSERT_TRUE(wait_until([&] { return says("\"up\":false") && has_dealt_with(sent); }))
        << get("/status").body;
    ASSERT_TRUE(run("ip link set vcanold up"));
    ASSERT_TRUE(wait_until([&] { return says("\"up\":true"); }));
  }
  const Answer status = get("/status");
  EXPECT_GT(status.number("lost_link_down"), 0);
  EXPECT_EQ(status.number("lost_link_down"), status.number("replies")) << status.body;
  EXPECT_EQ(status.number("sent"), 0) << status.body;
  EXPECT_EQ(status.number("link_losses"), kRounds);
  EXPECT_TRUE(Host("vcanold").query(1, kReadState2));
  expect_balanced(sent + 1);
}

/// The balance holds for any lost frames.
TEST_F(WatchedInterface, CountersBalanceAfterGoingDownDuringReplies) {
  make("vcanold");
  ReadyEmulator emulator(arguments());
  constexpr int kRounds = 5;
  std::uint64_t sent = 0;
  for (int round = 0; round < kRounds; ++round) {
    sent += send_queries();
    ASSERT_TRUE(run("ip link set vcanold down"));
    ASSERT_TRUE(wait_until([&] { return says("\"up\":false"); }));
    ASSERT_TRUE(run("ip link set vcanold up"));
    ASSERT_TRUE(wait_until([&] { return says("\"up\":true"); }));
  }
  ASSERT_TRUE(wait_until([&] { return has_dealt_with(sent); })) << get("/status").body;
  expect_balanced(sent);
  EXPECT_EQ(get("/status").number("link_losses"), kRounds);
}

// --- clocks

/// The wall clock, restored at the end.
class WallClock {
 public:
  WallClock() : mono_(MonoClock::now()) { ::gettimeofday(&before_, nullptr); }
  ~WallClock() {
    const auto passed = std::chrono::duration_cast<std::chrono::seconds>(MonoClock::now() - mono_);
    before_.tv_sec += passed.count();
    ::settimeofday(&before_, nullptr);
  }
  static void step(double seconds) {
    timeval now{};
    ::gettimeofday(&now, nullptr);
    const double to =
        static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_usec) + seconds;
    now.tv_sec = static_cast<time_t>(to);
    now.tv_usec = static_cast<suseconds_t>((to - static_cast<double>(now.tv_sec)) * 1e6);
    ASSERT_EQ(::settimeofday(&now, nullptr), 0);
  }

 private:
  MonoClock::time_point mono_;
  timeval before_{};
};

class Clocks : public MachineTest {
 protected:
  Clocks() : MachineTest("vcan0") {}
};

TEST_F(Clocks, SettingTheWallClockHasNoEffect) {
  if (!in_user_mode_linux()) GTEST_SKIP() << "would set the clock of this machine";
  const WallClock wall;
  ReadyEmulator emulator(arguments());
  Host host("vcan0");
  const Reading begin = read_clock();
  std::uint64_t sent = 0;
  for (const double step_s : {7200.0, -7200.0, 0.3, -0.3, -86400.0, 86400.0, 0.04, -0.04}) {
    // Some frames arrive before the step and are read after it, some arrive after it.
    for (int n = 0; n < 20; ++n, ++sent) host.send(0x141, kReadState2);
    WallClock::step(step_s);
    for (int n = 0; n < 20; ++n, ++sent) host.send(0x142, kReadState2);
    for (int n = 0; n < 40; ++n) ASSERT_TRUE(host.receive()) << step_s << " s, reply " << n;
    ASSERT_TRUE(host.query(3, kReadState2)) << step_s;
    ++sent;
  }
  const Reading end = read_clock();
  expect_no_drift(begin, end);
  expect_balanced(sent);
  EXPECT_EQ(emulator.stop().status, 0);
}

// --- the processor

class Processor : public Clocks {};

/// Occupies the only processor for `span`, with real-time priority.
void hog_processor(std::chrono::milliseconds span) {
  const pid_t child = ::fork();
  if (child == 0) {
    sched_param highest{};
    highest.sched_priority = 50;
    if (::sched_setscheduler(0, SCHED_FIFO, &highest) != 0) ::_exit(1);
    for (const auto end = MonoClock::now() + span; MonoClock::now() < end;) {
    }
    ::_exit(0);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
}

TEST_F(Processor, StarvationSlipsTimeWithoutLoss) {
  if (!in_user_mode_linux()) GTEST_SKIP() << "would stop this machine";
  ASSERT_TRUE(run("echo -1 >/proc/sys/kernel/sched_rt_runtime_us"));
  ReadyEmulator emulator(arguments());
  Host host("vcan0");
  const Reading begin = read_clock();
  std::uint64_t sent = 0;
  for (int round = 0; round < 5; ++round) {
    for (int n = 0; n < 100; ++n, ++sent) host.send(0x141, kReadState2);
    hog_processor(std::chrono::milliseconds(200));
    for (int n = 0; n < 100; ++n) ASSERT_TRUE(host.receive()) << round << ", reply " << n;
  }
  const Reading end = read_clock();
  expect_no_drift(begin, end);
  EXPECT_GE(end.slipped_s - begin.slipped_s, 5 * (0.2 - 0.051));
  expect_balanced(sent);
  const auto result = emulator.stop();
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.err.find("simulated time slips"), std::string::npos);
  EXPECT_NE(result.out.find("simulated time slipped"), std::string::npos) << result.out;
  run("echo 950000 >/proc/sys/kernel/sched_rt_runtime_us");
}

TEST_F(Processor, StaysConsistentUnderHighPriorityLoad) {
  ReadyEmulator emulator(arguments());
  constexpr int kPriority = -5;  // each gets three times the emulator's share
  std::vector<pid_t> busy;
  for (int n = 0; n < 4; ++n) {
    const pid_t child = ::fork();
    if (child == 0) {
      // Without permission for this priority the number of processes suffices.
      static_cast<void>(::setpriority(PRIO_PROCESS, 0, kPriority));
      for (;;) {
      }
    }
    busy.push_back(child);
  }
  Host host("vcan0");
  const Reading begin = read_clock();
  constexpr int kQueries = 50;
  for (int n = 0; n < kQueries; ++n) EXPECT_TRUE(host.query(1 + n % 4, kReadState2)) << n;
  const Reading end = read_clock();
  for (const pid_t child : busy) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  expect_no_drift(begin, end);
  expect_balanced(kQueries);
  EXPECT_EQ(emulator.stop().status, 0);
}

}  // namespace machine_test
}  // namespace lk::host

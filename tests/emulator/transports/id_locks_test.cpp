#include "emulator/io/transports/id_locks.hpp"

#include <gtest/gtest.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <functional>

#include "emulator/core/start_error.hpp"
#include "tests/support/id_lock.hpp"

namespace lk::emulator {
namespace id_locks_test {

/// Returns a name unique to this process, because the network namespace is shared.
std::string bus(const std::string& name = "") { return "t" + std::to_string(::getpid()) + name; }

/// Returns the reason why taking the lock failed, or nothing.
std::string taken(IdLocks& locks, const std::string& interface, int id,
                  const LinkState& link = {}) {
  try {
    locks.take(interface, link, id);
    return "";
  } catch (const StartError& problem) {
    return problem.what();
  }
}

/// A process that runs `act`, reports this through a pipe, and stays until killed.
class Other {
 public:
  explicit Other(const std::function<void()>& act) {
    std::array<int, 2> ready{};
    EXPECT_EQ(::pipe(ready.data()), 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      act();
      (void)!::write(ready[1], "x", 1);
      ::pause();
      ::_exit(0);
    }
    ::close(ready[1]);
    char said = 0;
    EXPECT_EQ(::read(ready[0], &said, 1), 1) << "it has ended";
    ::close(ready[0]);
  }
  Other(const Other&) = delete;
  Other& operator=(const Other&) = delete;
  ~Other() { kill(); }
  void kill() {
    if (pid_ > 0) ::kill(pid_, SIGKILL);
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  std::string pid() const { return std::to_string(pid_); }

 private:
  pid_t pid_ = 0;
};

TEST(IdLocks, NameTheHolderUntilItIsKilled) {
  const std::string here = bus();
  IdLocks theirs;
  Other other([&] { theirs.take(here, {}, 3); });
  IdLocks locks;
  EXPECT_EQ(taken(locks, here, 3), here + ": ID 3 is already in use by lk-emu (pid " + other.pid() +
                                       "); stop it, or give other --ids");
  EXPECT_EQ(taken(locks, here, 4), "") << "another drive";
  EXPECT_EQ(taken(locks, bus("b"), 3), "") << "another bus";
  other.kill();
  EXPECT_EQ(taken(locks, here, 3), "");
}

TEST(IdLocks, RejectOneInterfaceUnderTwoNames) {
  IdLocks locks;
  LinkState link;
  link.name = bus();
  EXPECT_EQ(taken(locks, "alias", 3, link), "");
  EXPECT_EQ(taken(locks, bus(), 3),
            bus() +
                ": ID 3 is given twice: another of the buses is the other end of this vxcan pair, "
                "or the same interface by another name");
}

TEST(IdLocks, LockBothEndsOfAPair) {
  LinkState end;
  end.name = bus();
  end.peer = static_cast<int>(::if_nametoindex("lo"));  // any existing interface
  ASSERT_NE(end.peer, 0);
  IdLocks locks;
  EXPECT_EQ(taken(locks, bus(), 7, end), "");
  EXPECT_NE(taken(locks, "lo", 7), "");
  EXPECT_NE(taken(locks, bus(), 7), "");
}

TEST(IdLocks, NameTheHolderInEveryRefusal) {
  const std::string here = bus();
  IdLocks holder;
  holder.take(here, {}, 3);
  Other other([&] {
    IdLocks locks;
    for (int n = 0; n < 1000; ++n) {
      holder.drain_queue();
      try {
        locks.take(here, {}, 3);
        ::_exit(1);
      } catch (const StartError& problem) {
        const std::string who = "lk-emu (pid " + std::to_string(::getppid()) + ")";
        if (std::string(problem.what()).find(who) == std::string::npos) ::_exit(1);
      }
    }
  });
}

/// The owner of the name may be another program that does not answer.
TEST(IdLocks, DoNotWaitForAForeignHolder) {
  const std::string refusal = bus() +
                              ": ID 3 is already in use by another program (perhaps in another "
                              "container); stop it, or give other --ids";
  IdLocks locks;
  Descriptor stranger = test::id_lock(bus(), 3);
  EXPECT_EQ(taken(locks, bus(), 3), refusal) << "it does not listen";
  stranger = Descriptor();
  stranger = test::id_lock(bus(), 3);
  ASSERT_EQ(::listen(stranger.get(), 0), 0);
  for (int n = 0; n < 10; ++n) EXPECT_NE(taken(locks, bus(), 3), "") << "it never accepts";
  EXPECT_EQ(taken(locks, bus(), 3),
            bus() + ": ID 3 is held by a program that does not respond; ss -xlp | grep lk-emu/" +
                bus() + "/3 shows it: stop it, or give other --ids")
      << "no more places in its queue";
  stranger = Descriptor();
  EXPECT_EQ(taken(locks, bus(), 3), "");
}

}  // namespace id_locks_test
}  // namespace lk::emulator

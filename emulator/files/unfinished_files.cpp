#include "emulator/files/unfinished_files.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>

namespace lk::emulator {
namespace {

/// Names of unfinished files for the signal handler; null: a free entry.
std::array<std::atomic<const char*>, 8> unfinished_files{};
static_assert(std::atomic<const char*>::is_always_lock_free);

extern "C" void remove_unfinished_and_end(int signal) {
  for (const auto& file : unfinished_files) {
    if (const char* const name = file.load()) ::unlink(name);
  }
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

/// Only signals with the default action.
void watch_signals() {
  for (const int signal : {SIGHUP, SIGINT, SIGTERM}) {
    struct sigaction present {};
    if (::sigaction(signal, nullptr, &present) != 0 || present.sa_handler != SIG_DFL) continue;
    present.sa_handler = remove_unfinished_and_end;
    ::sigaction(signal, &present, nullptr);
  }
}

void replace_unfinished(const char* before, const char* after) {
  for (auto& file : unfinished_files) {
    const char* expected = before;
    if (file.compare_exchange_strong(expected, after)) return;
  }
}

}  // namespace

void remove_if_ended(const char* path) {
  watch_signals();
  replace_unfinished(nullptr, path);
}

void keep_if_ended(const char* path) { replace_unfinished(path, nullptr); }

}  // namespace lk::emulator

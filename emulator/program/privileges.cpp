#include "emulator/program/privileges.hpp"

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// Returns true if `path` or a parent directory belongs to another user.
bool is_below_another(fs::path path) {
  for (;; path = path.parent_path()) {
    struct stat found {};
    if (::stat(path.c_str(), &found) == 0 && found.st_uid != ::geteuid()) return true;
    if (!path.has_relative_path()) return false;
  }
}

/// The path may be a link, for example to a terminal. Removing it needs rights in its directory,
/// writing needs rights at its target.
bool belongs_to_another(const fs::path& place) {
  const fs::path path = fs::absolute(place);
  std::error_code ignored;
  return is_below_another(fs::weakly_canonical(path.parent_path(), ignored)) ||
         is_below_another(fs::weakly_canonical(path, ignored));
}

[[noreturn]] void fail() {
  throw StartError(std::string("cannot give up capabilities: ") + std::strerror(errno));
}

}  // namespace

void give_up_privileges(const std::vector<fs::path>& places) {
  const bool keeps_files = ::geteuid() == 0 && std::ranges::any_of(places, belongs_to_another);
  const unsigned kept = keeps_files ? 1U << CAP_DAC_OVERRIDE : 0;
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail();
  ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  // A failure is harmless: after PR_SET_NO_NEW_PRIVS nothing can restore these capabilities.
  for (int capability = 0; ::prctl(PR_CAPBSET_READ, capability, 0, 0, 0) >= 0; ++capability) {
    ::prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);
  }
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> held{};
  if (::syscall(SYS_capget, &header, held.data()) != 0) fail();
  // The filter of the systemd unit blocks capset, but then nothing is left to give up.
  const auto is_empty = [](const __user_cap_data_struct& set) {
    return (set.effective | set.permitted | set.inheritable) == 0;
  };
  if (std::ranges::all_of(held, is_empty)) return;
  const unsigned left = held[0].permitted & kept;
  held = {};
  held[0].effective = held[0].permitted = left;
  if (::syscall(SYS_capset, &header, held.data()) != 0) fail();
}

}  // namespace lk::emulator

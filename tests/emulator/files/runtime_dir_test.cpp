#include "emulator/files/runtime_dir.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include "emulator/core/start_error.hpp"
#include "emulator/files/durable_file.hpp"
#include "tests/support/temp_directory.hpp"
#include "tools/ctl/ctl_client.hpp"

namespace lk::emulator {
namespace runtime_dir_test {

namespace fs = std::filesystem;

/// A runtime directory with a listening socket.
class RuntimeDirectory : public testing::Test {
 public:
  RuntimeDirectory(const RuntimeDirectory&) = delete;
  RuntimeDirectory& operator=(const RuntimeDirectory&) = delete;

 protected:
  RuntimeDirectory() {
    const char* const before = std::getenv("XDG_RUNTIME_DIR");
    if (before != nullptr) before_ = before;
    ::setenv("XDG_RUNTIME_DIR", own_.path().c_str(), 1);
    secure_directory(directory_);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(socket_.begin(), socket_.end(), std::begin(address.sun_path));
    EXPECT_EQ(::bind(listens_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              0);
    EXPECT_EQ(::listen(listens_.get(), 5), 0);
  }
  ~RuntimeDirectory() override {
    before_.empty() ? ::unsetenv("XDG_RUNTIME_DIR")
                    : ::setenv("XDG_RUNTIME_DIR", before_.c_str(), 1);
  }

  static std::string refusal() {
    try {
      return "found " + find_socket("", "").string();
    } catch (const StartError& problem) {
      return problem.what();
    }
  }

  test::TempDirectory own_;
  std::string before_;
  fs::path directory_ = own_.path() / "lk-emu";
  std::string socket_ = (directory_ / "vcan0-1.sock").string();
  Descriptor listens_{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
};

TEST_F(RuntimeDirectory, CtlFindsOwnSockets) {
  EXPECT_EQ(refusal(), "found " + socket_);
  fs::remove_all(directory_);
  EXPECT_EQ(refusal().rfind("ctl: no lk-emu is running here", 0), 0U) << refusal();
}

TEST_F(RuntimeDirectory, CtlRejectsOpenPermissions) {
  fs::permissions(directory_, fs::perms::all);
  const std::string name = directory_.string();
  EXPECT_EQ(refusal(), "ctl: " + name + " is open to others: chmod 700 " + name +
                           "; choose the socket with --socket PATH");
  EXPECT_EQ(find_socket(socket_, ""), socket_) << "who names it has decided";
}

TEST_F(RuntimeDirectory, CtlRejectsLink) {
  fs::rename(directory_, own_.path() / "other");
  fs::create_directory_symlink("other", directory_);
  EXPECT_EQ(refusal(), "ctl: " + directory_.string() +
                           " is not a directory: remove it; choose the socket with --socket PATH");
}

TEST_F(RuntimeDirectory, CtlRejectsForeignOwner) {
  constexpr uid_t kNobody = 65534;
  if (::chown(directory_.c_str(), kNobody, static_cast<gid_t>(-1)) != 0) {
    GTEST_SKIP() << "only root gives a directory away";
  }
  EXPECT_EQ(refusal(), "ctl: " + directory_.string() +
                           " belongs to another user; choose the socket with --socket PATH");
}

}  // namespace runtime_dir_test
}  // namespace lk::emulator

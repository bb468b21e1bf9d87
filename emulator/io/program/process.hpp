#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace lk::emulator {

/// Watches standard input, a pipe from the parent process, to notice the parent's end: the kernel
/// then closes the pipe, even after SIGKILL.
class InputWatch {
 public:
  /// Calls `on_end` once, from the loop, when standard input ends. Throws StartError if it is not a
  /// pipe or socket.
  InputWatch(boost::asio::io_context& loop, std::function<void()> on_end);

 private:
  void read_some();

  boost::asio::posix::stream_descriptor input_;
  std::function<void()> on_end_;
  std::array<char, 256> ignored_{};
};

/// Gives up all capabilities for good; root keeps CAP_DAC_OVERRIDE if one of the paths `places` is
/// of another user, or below a directory of one. Call before threads start, as each thread has its
/// own capabilities. Throws StartError.
void give_up_privileges(const std::vector<std::filesystem::path>& places);

/// Sends `state`, such as "READY=1", to the service manager (sd_notify(3)). Does nothing without a
/// service manager.
void notify_service_manager(const std::string& state);

}  // namespace lk::emulator

#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace lk::emulator {

/// Watches standard input, a pipe from the parent process: the kernel closes it however the parent
/// ends, also by SIGKILL.
class InputWatch {
 public:
  /// Calls `on_end` once, from the loop, when the input ends. Throws StartError if standard input
  /// is no pipe or socket.
  InputWatch(boost::asio::io_context& loop, std::function<void()> on_end);

 private:
  void read_some();

  boost::asio::posix::stream_descriptor input_;
  std::function<void()> on_end_;
  std::array<char, 256> ignored_{};
};

/// Gives up all capabilities for good. Root keeps CAP_DAC_OVERRIDE if it writes to `places` of
/// other users. Call before threads start, as each thread has its own capabilities. Throws
/// StartError.
void give_up_privileges(const std::vector<std::filesystem::path>& places);

/// Reports the state to the service manager (sd_notify(3)): "READY=1". Does nothing without a
/// service manager.
void notify_service_manager(const std::string& state);

}  // namespace lk::emulator

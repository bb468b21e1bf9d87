#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>

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

}  // namespace lk::emulator

#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>

namespace lk::emulator {

/// Watches standard input, a pipe that the parent process holds open: the kernel closes it however
/// the parent ends, by SIGKILL too.
class InputWatch {
 public:
  /// `on_end` is called once, from the loop, when the input has ended. Throws StartError unless
  /// standard input is a pipe or a socket.
  InputWatch(boost::asio::io_context& loop, std::function<void()> on_end);

 private:
  void read_some();

  boost::asio::posix::stream_descriptor input_;
  std::function<void()> on_end_;
  std::array<char, 256> ignored_{};
};

}  // namespace lk::emulator

#include "emulator/program/input_watch.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <cerrno>
#include <utility>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {

InputWatch::InputWatch(boost::asio::io_context& loop, std::function<void()> on_end)
    : input_(loop), on_end_(std::move(on_end)) {
  struct stat input {};
  // Rejects a terminal: Asio would make it non-blocking for the shell too.
  if (::fstat(STDIN_FILENO, &input) != 0 || !(S_ISFIFO(input.st_mode) || S_ISSOCK(input.st_mode))) {
    throw StartError("--end-with-stdin: standard input is not a pipe; start lk-emu with one");
  }
  const int descriptor = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (descriptor < 0) throw StartError("--end-with-stdin: " + reason_of(errno));
  input_.assign(descriptor);
  read_some();
}

void InputWatch::read_some() {
  input_.async_read_some(boost::asio::buffer(ignored_),
                         [this](const boost::system::error_code& error, std::size_t /*size*/) {
                           if (error == boost::asio::error::operation_aborted) return;
                           if (error) return on_end_();
                           read_some();
                         });
}

}  // namespace lk::emulator

#include "emulator/program/output_file.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "emulator/config/config_error.hpp"
#include "emulator/program/cli.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

namespace {

/// Names of unfinished files, where a signal handler can read them; null: a free place.
std::array<std::atomic<const char*>, 8> unfinished_files{};
static_assert(std::atomic<const char*>::is_always_lock_free);

extern "C" void remove_unfinished_and_end(int signal) {
  for (const auto& file : unfinished_files) {
    if (const char* const name = file.load()) ::unlink(name);
  }
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

/// Only where nobody has said yet what a signal does.
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

OutputFile::OutputFile(const fs::path& path, const std::string& option)
    : path_(path), unfinished_(path), option_(option) {
  if (path.empty()) throw StartError(option + ": needs a file");
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) fail(EISDIR);
  if (!fs::exists(status) || fs::is_regular_file(status)) {
    unfinished_ += ".part-" + std::to_string(::getpid());
  }
  if (unfinished_ != path_) {
    watch_signals();
    replace_unfinished(nullptr, unfinished_.c_str());
  }
  stream_ = std::fopen(unfinished_.c_str(), "w");
  if (stream_ == nullptr) {
    const int error = errno;
    forget_unfinished();
    fail(error);
  }
}

OutputFile::~OutputFile() {
  if (stream_ != nullptr) {
    std::fclose(stream_);
    if (unfinished_ != path_) ::unlink(unfinished_.c_str());
  }
  forget_unfinished();
}

void OutputFile::forget_unfinished() const { replace_unfinished(unfinished_.c_str(), nullptr); }

void OutputFile::write(const std::string& text) {
  errno = 0;
  if (error_ == 0 && std::fwrite(text.data(), 1, text.size(), stream_) != text.size()) {
    error_ = errno != 0 ? errno : EIO;
  }
}

void OutputFile::commit() {
  errno = 0;
  const bool closed = std::fclose(stream_) == 0;
  stream_ = nullptr;
  if (!closed && error_ == 0) error_ = errno != 0 ? errno : EIO;
  if (error_ == 0 && unfinished_ != path_ && std::rename(unfinished_.c_str(), path_.c_str()) != 0) {
    error_ = errno;
  }
  if (error_ == 0) return;
  if (unfinished_ != path_) ::unlink(unfinished_.c_str());
  fail(error_);
}

void OutputFile::fail(int error) const {
  throw StartError(option_ + ": cannot write " + on_one_line(path_.string()) + ": " +
                   std::strerror(error));
}

}  // namespace lk::emulator

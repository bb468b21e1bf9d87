#include "emulator/program/output_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "emulator/program/cli.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

OutputFile::OutputFile(const fs::path& path, const std::string& option)
    : path_(path), unfinished_(path), option_(option) {
  if (path.empty()) throw StartError(option + ": needs a file");
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) fail(EISDIR);
  if (!fs::exists(status) || fs::is_regular_file(status)) {
    unfinished_ += ".part-" + std::to_string(::getpid());
  }
  stream_ = std::fopen(unfinished_.c_str(), "w");
  if (stream_ == nullptr) fail(errno);
}

OutputFile::~OutputFile() {
  if (stream_ == nullptr) return;
  std::fclose(stream_);
  if (unfinished_ != path_) ::unlink(unfinished_.c_str());
}

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
  throw StartError(option_ + ": cannot write " + path_.string() + ": " + std::strerror(error));
}

}  // namespace lk::emulator

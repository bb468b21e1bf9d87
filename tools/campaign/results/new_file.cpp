#include "tools/campaign/results/new_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string>

#include "emulator/files/durable_file.hpp"
#include "emulator/files/unfinished_files.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

namespace {

/// Not every file system has hard links, nor does every one refuse to replace a file.
int give_name(const fs::path& from, const fs::path& to) {
  if (::link(from.c_str(), to.c_str()) == 0) return 0;
  if (errno == EEXIST) return EEXIST;
  return ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0 ? 0
                                                                                          : errno;
}

int sync(const fs::path& path) {
  const Descriptor opened(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return opened && ::fsync(opened.get()) == 0 ? 0 : errno;
}

}  // namespace

NewFile::NewFile(const fs::path& path) : path_(path), unfinished_(path) {
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(path, ignored))) fail(EEXIST);
  unfinished_ += ".part-" + std::to_string(::getpid());
  ::unlink(unfinished_.c_str());  // of a killed program that had this number
  remove_if_ended(unfinished_.c_str());
  const Descriptor file(
      ::open(unfinished_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
  if (file) return;
  const int error = errno;
  keep_if_ended(unfinished_.c_str());
  fail(error);
}

NewFile::~NewFile() {
  ::unlink(unfinished_.c_str());
  keep_if_ended(unfinished_.c_str());
}

void NewFile::finish() {
  if (const int error = sync(unfinished_)) fail(error);
  if (const int error = give_name(unfinished_, path_)) fail(error);
  sync(path_.has_parent_path() ? path_.parent_path() : ".");  // not every file system can
}

void NewFile::fail(int error) const {
  throw StartError(on_one_line(path_.string()) + ": " +
                   (error == EEXIST ? "there is such a file already, and it stays as it is"
                                    : "cannot be made: " + reason_of(error)));
}

}  // namespace lk::emulator

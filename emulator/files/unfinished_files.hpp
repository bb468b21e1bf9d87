#pragma once

namespace lk::emulator {

/// From now on, a signal that would end the program removes the file first: SIGHUP, SIGINT and
/// SIGTERM, where nobody has said what they do. `path` has to stay where it is in memory until
/// `keep_if_ended` gets it. Of more than eight at a time, some are not removed.
void remove_if_ended(const char* path);
void keep_if_ended(const char* path);

}  // namespace lk::emulator

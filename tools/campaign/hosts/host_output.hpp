#pragma once

#include <functional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "tools/campaign/hosts/host_case.hpp"

namespace lk::emulator {

/// A line without its words in which there is a digit or a slash: times, process IDs, ports and
/// paths differ from run to run.
std::string gist_of(std::string_view line);

/// What a host says, line by line.
class HostOutput {
 public:
  /// Throws StartError when one of `lines` is no expression.
  explicit HostOutput(const std::vector<std::string>& lines);

  /// Takes all that can be read from `fd` now. Of a line that tells, `now` gives the time.
  /// Returns false when no more will come.
  bool take(int fd, const std::function<SimTime()>& now);
  /// It has ended: a line without an end is one too.
  void finish(const std::function<SimTime()>& now);

  /// The first of each gist.
  const std::vector<HostNotice>& notices() const { return notices_; }
  const std::string& tail() const { return tail_; }

 private:
  void take(std::string_view text, const std::function<SimTime()>& now);
  void look_at_line(const std::function<SimTime()>& now);

  std::vector<std::regex> telling_;
  std::string line_;  // the present one, as far as it is looked at
  std::string tail_;
  std::vector<HostNotice> notices_;
};

}  // namespace lk::emulator

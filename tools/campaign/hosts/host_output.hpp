#pragma once

#include <functional>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "tools/campaign/hosts/host_case.hpp"

namespace lk::emulator {

/// What a host says, line by line.
class HostOutput {
 public:
  /// Throws StartError when one of `lines` is no expression.
  explicit HostOutput(const std::vector<std::string>& lines);

  /// Takes all that can be read from `fd` now. Of the first line that tells, `now` gives the time.
  /// Returns false when no more will come.
  bool take(int fd, const std::function<SimTime()>& now);
  /// It has ended: a line without an end is one too.
  void finish(const std::function<SimTime()>& now);

  const std::optional<HostNotice>& noticed() const { return noticed_; }
  const std::string& tail() const { return tail_; }

 private:
  void take(std::string_view text, const std::function<SimTime()>& now);
  void look_at_line(const std::function<SimTime()>& now);

  std::vector<std::regex> telling_;
  std::string line_;  // the present one, as far as it is looked at
  std::string tail_;
  std::optional<HostNotice> noticed_;
};

}  // namespace lk::emulator

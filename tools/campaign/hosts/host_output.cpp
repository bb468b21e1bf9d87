#include "tools/campaign/hosts/host_output.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

/// Of a line, this is searched: the library's search takes stack for each byte.
constexpr std::size_t kLongestSearched = 2000;

}  // namespace

std::string gist_of(std::string_view line) {
  std::string gist;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    const std::string_view word = line.substr(0, end);
    if (word.find_first_of("0123456789/") == std::string_view::npos) gist.append(word) += ' ';
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return gist;
}

HostOutput::HostOutput(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    try {
      telling_.emplace_back(line, std::regex::ECMAScript | std::regex::optimize);
    } catch (const std::regex_error& problem) {
      throw StartError("host: says: \"" + line + "\" is no regular expression: " + problem.what());
    }
  }
}

bool HostOutput::take(int fd, const std::function<SimTime()>& now) {
  std::array<char, 16384> buffer;
  for (;;) {
    const ssize_t size = ::read(fd, buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) return true;
    if (size <= 0) return false;
    take(std::string_view(buffer.data(), static_cast<std::size_t>(size)), now);
  }
}

void HostOutput::take(std::string_view text, const std::function<SimTime()>& now) {
  tail_ += text;
  if (tail_.size() > kLongestOutput) tail_.erase(0, tail_.size() - kLongestOutput);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    line_ += text.substr(0, std::min(end, kLongestSearched - line_.size()));
    if (end == text.size()) return;
    look_at_line(now);
    text.remove_prefix(end + 1);
  }
}

void HostOutput::finish(const std::function<SimTime()>& now) {
  if (!line_.empty()) look_at_line(now);
}

void HostOutput::look_at_line(const std::function<SimTime()>& now) {
  if (line_.ends_with('\r')) line_.pop_back();
  const auto telling = std::ranges::find_if(
      telling_, [&](const std::regex& one) { return std::regex_search(line_, one); });
  if (telling != telling_.end() && notices_.size() < kMostNotices) {
    const std::string gist = gist_of(line_);
    if (std::ranges::find(notices_, gist, &HostNotice::gist) == notices_.end()) {
      const auto rule = static_cast<std::size_t>(telling - telling_.begin()) + 1;
      notices_.push_back({now(), line_.substr(0, kLongestNotice), rule, gist});
    }
  }
  line_.clear();
}

}  // namespace lk::emulator

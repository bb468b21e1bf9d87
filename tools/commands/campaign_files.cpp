#include "tools/commands/campaign_files.hpp"

#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/commands/campaign_actions.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// Whatever links and dots say; of files that are there, and of those that are not yet.
bool is_same(const fs::path& one, const fs::path& other) {
  std::error_code error;
  if (fs::equivalent(one, other, error)) return true;
  return fs::weakly_canonical(fs::absolute(one), error) ==
         fs::weakly_canonical(fs::absolute(other), error);
}

void check_place(const std::string& option, const fs::path& file) {
  const std::string name = on_one_line(file.string());
  const fs::path directory = file.has_parent_path() ? file.parent_path() : ".";
  if (!fs::is_directory(directory)) {
    throw StartError(option + ": there is no directory " + on_one_line(directory.string()));
  }
  if (fs::is_directory(file)) throw StartError(option + ": " + name + " is a directory");
  // A file is written beside its place; what is none, a pipe, as it is.
  const bool as_it_is = fs::exists(file) && !fs::is_regular_file(file);
  const fs::path written = as_it_is ? file : directory;
  if (::access(written.c_str(), W_OK) == 0) return;
  throw StartError(option + ": " + name +
                   " cannot be written: " + std::generic_category().message(errno));
}

}  // namespace

void check_reports(const CampaignReports& reports, std::vector<NamedFile> others) {
  const NamedFile files[] = {
      {reports.html, "--html"}, {reports.json, "--json"}, {reports.junit, "--junit"}};
  for (const auto& [file, option] : files) {
    if (file.empty()) continue;
    check_place(option, file);
    if (fs::exists(file) && !fs::is_regular_file(file)) continue;  // /dev/stdout may have several
    for (const auto& [other, what] : others) {
      if (other.empty() || !is_same(file, other)) continue;
      throw StartError(option + ": " + on_one_line(file.string()) + " is also " + what +
                       "; give it a name of its own");
    }
    others.emplace_back(file, "for " + option);
  }
}

}  // namespace lk::emulator

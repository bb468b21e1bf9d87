#pragma once

/// @file Where a campaign's reports go: told to be of no use before a night is spent on them.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace lk::emulator {

struct CampaignReports;

/// A file that is read or written besides, and what it is: {"night.db", "the results"}.
using NamedFile = std::pair<std::filesystem::path, std::string>;

/// Throws StartError when a report has no directory, is one, cannot be written, or would take the
/// place of one of `others` or of another report.
void check_reports(const CampaignReports& reports, std::vector<NamedFile> others);

}  // namespace lk::emulator

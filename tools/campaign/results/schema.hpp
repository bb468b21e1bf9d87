#pragma once

#include "tools/campaign/results/case_result.hpp"
#include "tools/campaign/results/sqlite.hpp"

namespace lk::emulator {

/// Numbers of cases, below it, are integers of SQLite.
inline constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << 62;

/// Makes an empty file, which nobody is to find yet (new_file.hpp), that of a campaign without
/// cases. Throws StartError when two dimensions
/// share a name, or one has that of another column.
void write_schema(Database& database, const CampaignHead& head);

/// Whose campaign it is. Throws StartError when it is no campaign's file, of another format, or
/// damaged.
CampaignHead read_head(const Database& database);

}  // namespace lk::emulator

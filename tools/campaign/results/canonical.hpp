#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "tools/campaign/results/campaign_store.hpp"

namespace lk::emulator {

/// CSV (RFC 4180, lines end in \n): names of columns, then a line a case in ascending order. Times
/// are integers of ns, other numbers the shortest text that reads as the same value; what is not
/// there is empty. Says nothing of the wall clock: the same cases give the same bytes, in whatever
/// order, batches and shards they came.
void export_canonical(const CampaignStore& store,
                      const std::function<void(std::string_view)>& write);

/// Its first line, and that of a case, each with its \n. Two results are the same if their lines
/// are.
std::string canonical_header(const CampaignHead& head);
std::string canonical_line(const CaseResult& result);

}  // namespace lk::emulator

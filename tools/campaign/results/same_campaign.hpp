#pragma once

#include <optional>
#include <string>

#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

/// What sets the campaign `other` apart from `mine`, to be said of `other`; nothing: they are the
/// same.
std::optional<std::string> difference(const CampaignHead& other, const CampaignHead& mine);

}  // namespace lk::emulator

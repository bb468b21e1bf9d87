#include "tools/campaign/results/same_campaign.hpp"

#include "emulator/ground/text.hpp"

namespace lk::emulator {

std::optional<std::string> difference(const CampaignHead& other, const CampaignHead& mine) {
  if (other == mine) return std::nullopt;
  if (other.version != mine.version) {
    return "of version " + on_one_line(other.version) + ", and not of " + on_one_line(mine.version);
  }
  if (other.plan_name != mine.plan_name) {
    return "of the plan " + on_one_line(other.plan_name) + ", and not of " +
           on_one_line(mine.plan_name);
  }
  if (other.plan_text != mine.plan_text) {
    return "of another plan that was also called " + on_one_line(mine.plan_name);
  }
  if (other.input_hash != mine.input_hash) {
    return "of other input: a file that the plan names was changed";
  }
  return "of another campaign";
}

}  // namespace lk::emulator

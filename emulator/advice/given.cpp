#include "emulator/advice/given.hpp"

#include <algorithm>

namespace lk::emulator {

bool GivenList::has_room(int id, AdviceKind kind) const {
  const auto causes = std::ranges::count_if(
      all_, [&](const Advice& advice) { return advice.id == id && advice.found.kind == kind; });
  return all_.size() < kMost && static_cast<std::size_t>(causes) < kMostCauses;
}

void GivenList::note(int id, const Finding& finding, const Suspect& suspect, std::uint64_t times) {
  Mark& mark = marks_[suspect.number % kMarks];
  if (mark.number != suspect.number) mark = {suspect.number, finding.kind};
  const auto known = std::ranges::find_if(all_, [&](const Advice& advice) {
    return advice.id == id && same_cause(advice.found, finding);
  });
  if (known == all_.end()) {
    if (!has_room(id, finding.kind)) {
      left_out_ += times;
      return;
    }
    all_.push_back({finding, id, times, suspect.at, suspect.frame});
    return;
  }
  known->count += times;
  if (finding.renews) known->found = finding;
}

std::string_view GivenList::mark_of(std::uint64_t number) const {
  const Mark& mark = marks_[number % kMarks];
  return number != 0 && mark.number == number ? advice_row(mark.kind).word : std::string_view();
}

}  // namespace lk::emulator

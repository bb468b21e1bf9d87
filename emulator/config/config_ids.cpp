#include "emulator/config/config_ids.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include "emulator/config/config.hpp"

namespace lk::emulator {
namespace {

/// Parses a decimal number; nothing may surround it.
int parse_id(const std::string& text) {
  int id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  const bool whole = end == text.data() + text.size() && !text.empty();
  if (error == std::errc::result_out_of_range) id = kMaxId + 1;
  if (!whole) throw std::invalid_argument("\"" + text + "\" is not an ID; write 1-4 or 1,3,7-9");
  if (id < 1 || id > kMaxId) {
    throw std::invalid_argument("ID " + text + " is outside 1.." + std::to_string(kMaxId));
  }
  return id;
}

}  // namespace

std::vector<int> parse_ids(const std::string& text) {
  std::set<int> ids;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    const std::string part = text.substr(start, comma - start);
    const std::size_t dash = part.find('-');
    const int first = parse_id(part.substr(0, dash));
    const int last = dash == std::string::npos ? first : parse_id(part.substr(dash + 1));
    if (last < first) throw std::invalid_argument("the range " + part + " runs backwards");
    for (int id = first; id <= last; ++id) {
      if (!ids.insert(id).second) {
        throw std::invalid_argument("ID " + std::to_string(id) + " is given twice");
      }
    }
    start = comma + 1;
  }
  return {ids.begin(), ids.end()};
}

std::vector<int> read_ids(TableReader& reader) {
  const auto id = reader.integer("id", 1, kMaxId);
  const auto ids = reader.text("ids");
  if (id && ids) reader.fail("ids", "give either id or ids");
  if (id) return {static_cast<int>(*id)};
  if (!ids) return {};
  try {
    return parse_ids(*ids);
  } catch (const std::invalid_argument& problem) {
    reader.fail("ids", problem.what());
  }
}

}  // namespace lk::emulator

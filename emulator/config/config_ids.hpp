#pragma once

#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// The IDs that the keys `id` or `ids` of a table list, ascending; empty when there is neither.
std::vector<int> read_ids(TableReader& reader);

/// Which of the two keys is there, for complaints.
inline const char* ids_key(const TableReader& reader) { return reader.has("ids") ? "ids" : "id"; }

}  // namespace lk::emulator

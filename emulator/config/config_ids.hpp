#pragma once

#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// Reads the keys `id` or `ids` of a table; ascending, empty if both are absent.
std::vector<int> read_ids(TableReader& reader);

/// Returns which of the two keys is present, for messages.
inline const char* ids_key(const TableReader& reader) { return reader.has("ids") ? "ids" : "id"; }

}  // namespace lk::emulator

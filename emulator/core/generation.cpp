#include "emulator/core/generation.hpp"

#include <cstddef>

namespace lk::emulator {
namespace {

const protocol::GenerationRow& row_of(Generation generation) {
  return protocol::kGenerationRows.at(static_cast<std::size_t>(generation));
}

}  // namespace

Quirks quirks_of(Generation generation, protocol::Framing framing) {
  Quirks quirks;
  const protocol::GenerationRow& row = row_of(generation);
  quirks.dialect = framing == protocol::Framing::kSerial ? row.serial : row.dialect;
  const bool newer = generation != Generation::kLegacy && generation != Generation::kLateLegacy;
  quirks.run_resumes = !newer;
  quirks.off_needs_run = newer;
  // Multi-turn angle at power-up: two teams saw 0 on RS-485, two saw the single-turn angle on CAN.
  if (framing == protocol::Framing::kSerial) quirks.boot_multi_turn = BootMultiTurn::kZero;
  return quirks;
}

std::string_view generation_name(Generation generation) { return row_of(generation).name; }

std::optional<Generation> generation_of(std::string_view name) {
  for (std::size_t k = 0; k < protocol::kGenerationRows.size(); ++k) {
    if (protocol::kGenerationRows[k].name == name) return static_cast<Generation>(k);
  }
  return std::nullopt;
}

std::vector<std::string> generation_names() {
  std::vector<std::string> names;
  for (const auto& row : protocol::kGenerationRows) names.emplace_back(row.name);
  return names;
}

}  // namespace lk::emulator

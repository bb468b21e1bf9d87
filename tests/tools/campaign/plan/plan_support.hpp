#pragma once

/// @file A plan from its [dimension]s, on the scenario of the jammed joint.

#include <filesystem>
#include <string>

#include "tools/campaign/plan/plan_file.hpp"

namespace lk::emulator {

inline Plan plan_of(const std::string& sampling, const std::string& dimensions,
                    const std::string& rest = "") {
  const std::filesystem::path scenarios =
      std::filesystem::path(LKEMU_SOURCE_DIR) / "configs/scenarios";
  return parse_plan("scenario = \"jammed_joint.toml\"\nsampling = \"" + sampling + "\"\n" + rest +
                        "\n[dimension]\n" + dimensions,
                    scenarios / "plan.toml");
}

inline std::string text_of(const CaseValues& values) {
  std::string text;
  for (const auto& value : values) {
    text += (text.empty() ? "" : " ") + (value ? value_text(*value) : std::string("-"));
  }
  return text;
}

}  // namespace lk::emulator

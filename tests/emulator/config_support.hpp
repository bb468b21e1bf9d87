#pragma once

#include <gtest/gtest.h>

#include <string>

#include "emulator/config_error.hpp"

namespace lk::emulator {

/// The message of the ConfigError that `parse` throws.
template <typename Parse>
std::string config_error(Parse parse) {
  try {
    parse();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace lk::emulator

#include <CLI/CLI.hpp>

#include "emulator/ground/start_error.hpp"
#include "tools/commands/commands.hpp"

/// @file Stands in for campaign in a build without LKEMU_ANALYSIS.

namespace lk::emulator {
namespace {

[[noreturn]] void refuse() {
  throw StartError("built without campaign: configure with -DLKEMU_ANALYSIS=ON");
}

}  // namespace

int run_campaigns(int /*argc*/, const char* const* /*argv*/) { refuse(); }

std::shared_ptr<CLI::App> campaign_app() { return std::make_shared<CLI::App>(); }

}  // namespace lk::emulator

#pragma once

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// Wraps the help of `app` and of its subcommands to 80 columns, except examples.
void wrap_help(CLI::App& app);

}  // namespace lk::emulator

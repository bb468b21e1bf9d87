#pragma once

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// The help of `app` and of its words fits a terminal of 80 columns, examples aside.
void wrap_help(CLI::App& app);

}  // namespace lk::emulator

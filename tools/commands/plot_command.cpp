#include <CLI/CLI.hpp>
#include <string>

#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/language_option.hpp"
#include "tools/commands/python_package.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kPlotFooter = R"(
Needs Python 3.11 or newer with matplotlib: apt install python3-matplotlib.

Exit status: 0 drawn, 1 failed while running, 2 unusable input, or the picture cannot be written.)";

/// The options of python/lkemu/plot.py, for the help, the completions and their check.
struct PlotApp {
  CLI::App app{"Draw a CSV file of lk-emu run or lk-emu replay as SVG or PNG", "lk-emu plot"};
  std::string given;
  std::string language;

  PlotApp() {
    app.footer(kPlotFooter);
    app.add_option("FILE", given, "what --csv wrote")->required();
    app.add_option("-o,--output", given,
                   "the picture, an .svg or .png (default: an .svg beside the CSV file)")
        ->type_name("FILE");
    app.add_option("--bus", given, "drives of this bus only")->type_name("BUS");
    app.add_option("--ids", given, "of which drives (default: the first six): 1-4 or 1,3,7-9")
        ->type_name("LIST");
    add_language_option(app, language);
  }
};

}  // namespace

std::shared_ptr<CLI::App> plot_app() {
  const auto made = std::make_shared<PlotApp>();
  return {made, &made->app};
}

int run_plot(int argc, const char* const* argv) {
  PlotApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  become_python("lkemu.plot", argc, argv);
}

}  // namespace lk::emulator

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "emulator/config/config.hpp"
#include "emulator/config/config_error.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/language_option.hpp"
#include "tools/plot/run_picture.hpp"
#include "tools/plot/svg.hpp"
#include "tools/plot/svg_text.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlotFooter = R"(
Exit status: 0 drawn, 1 failed while running, 2 unusable input, or the picture cannot be written.)";

struct Request {
  std::string csv;
  std::string output;
  std::string bus;
  std::string ids;
  std::string language;
};

struct PlotApp {
  CLI::App app{"Draw a CSV file of lk-emu run or lk-emu replay as SVG", "lk-emu plot"};
  Request request;

  PlotApp() {
    app.footer(kPlotFooter);
    app.add_option("FILE", request.csv, "what --csv wrote")->required();
    app.add_option("-o,--output", request.output,
                   "the picture, an .svg (default: beside the CSV file)")
        ->type_name("FILE");
    app.add_option("--bus", request.bus, "drives of this bus only")->type_name("BUS");
    app.add_option("--ids", request.ids, "of which drives (default: the first six): 1-4 or 1,3,7-9")
        ->type_name("LIST");
    add_language_option(app, request.language);
  }
};

/// Throws StartError.
fs::path output_file(const Request& request) {
  if (request.output.empty()) {
    fs::path file = fs::path(request.csv).replace_extension(".svg");
    if (file == request.csv)
      throw StartError("plot: needs -o FILE, or it would draw over its input");
    return file;
  }
  fs::path file = request.output;
  if (file.extension() == ".svg") return file;
  std::string why = "--output: " + on_one_line(file.string()) + " does not end in .svg";
  if (file.extension() == ".png") {
    why +=
        "; for a PNG: lk-emu plot run.csv -o run.svg && rsvg-convert -o run.png run.svg "
        "(Debian: librsvg2-bin)";
  }
  throw StartError(why);
}

DriveChoice choice_of(const Request& request) {
  DriveChoice choice{request.bus, {}};
  if (request.ids.empty()) return choice;
  try {
    choice.ids = parse_ids(request.ids);
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--ids: ") + problem.what());
  }
  return choice;
}

std::string summary(const fs::path& file, const ChosenDrives& drives, const PlottedRows& rows) {
  std::string text =
      fmt::format("{}: {} drive{}, {} row{}", on_one_line(file.string()), drives.shown.size(),
                  drives.shown.size() == 1 ? "" : "s", rows.count, rows.count == 1 ? "" : "s");
  if (rows.count > 0) text += fmt::format(", {} to {} s", rows.first_s, rows.last_s);
  for (std::size_t n = 0; n < drives.left_out.size(); ++n) {
    text += n == 0 ? "; not shown, see --ids: " : ", ";
    text += drive_name(drives.left_out[n], Language::kEnglish);
  }
  return text;
}

}  // namespace

std::shared_ptr<CLI::App> plot_app() {
  const auto made = std::make_shared<PlotApp>();
  return {made, &made->app};
}

int run_plot(int argc, const char* const* argv) {
  PlotApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  const Request& request = given.request;
  // All that can be refused, before anything is read that may be long.
  const fs::path file = output_file(request);
  const DriveChoice choice = choice_of(request);
  const Language language = chosen_language(request.language);
  RunCsv csv = open_run_csv(request.csv);
  const ChosenDrives drives = choose_drives(csv.columns(), choice);
  OutputFile output(file, "--output");

  const std::string title = on_one_line(fs::path(request.csv).stem().string());
  PlottedRows rows;
  output.write(to_svg(picture_of(csv, drives, title, language, rows)));
  output.commit();
  std::printf("%s\n", summary(file, drives, rows).c_str());
  return 0;
}

}  // namespace lk::emulator

// How rare the planted bugs are: planted_sweep BUG CASES [SEED] draws so many cases and tells how
// many of them fail, the margins, and of the first that fail the values, each with a neighbour that
// passes: one of its values moved. `nofault` behind the seed: the same without any fault.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "tests/tools/campaign/planted/planted_case.hpp"
#include "tests/tools/campaign/planted/planted_random.hpp"

namespace lk::emulator::planted {
namespace {

constexpr int kShown = 6;

PlantedRun run_of(const Bug& bug, const Scenario& base, const Values& values) {
  const PlantedCase one = case_of(base, values);
  return bug.run(one.scenario, one.host);
}

void print(const Values& values) {
  std::printf("{");
  for (const auto& [name, value] : values) {
    if (const auto* word = std::get_if<std::string>(&value)) {
      std::printf("{\"%s\", \"%s\"}, ", name.c_str(), word->c_str());
    } else {
      std::printf("{\"%s\", %.6g}, ", name.c_str(), std::get<double>(value));
    }
  }
  std::printf("},\n");
}

/// One that passes, with one value moved by a twentieth of its range or to another word.
void print_neighbour(const Bug& bug, const Scenario& base, const Values& failing) {
  for (const Dimension& dimension : bug.dimensions) {
    if (!dimension.words.empty() || !dimension.numbers.empty()) continue;
    for (const double share : {-0.05, 0.05, -0.1, 0.1}) {
      Values moved = failing;
      double& value = std::get<double>(moved[dimension.name]);
      value =
          std::clamp(value + share * (dimension.to - dimension.from), dimension.from, dimension.to);
      if (run_of(bug, base, moved).failed) continue;
      std::printf("   passes with %s %.6g\n", dimension.name.c_str(), value);
      break;
    }
  }
}

int sweep(const Bug& bug, int cases, std::uint64_t seed, bool faulty) {
  const Scenario base = base_scenario(bug);
  std::mt19937_64 random(seed);
  int failed = 0;
  int fired = 0;
  std::vector<double> margins;       // of all
  std::map<std::string, int> kinds;  // of those that fail
  std::clock_t computing = 0;
  for (int n = 0; n < cases; ++n) {
    Values values = draw_case(bug, random);
    if (!faulty) values.erase("fault.kind");
    const std::clock_t start = std::clock();
    const PlantedRun run = run_of(bug, base, values);
    computing += std::clock() - start;
    if (run.fired) ++fired;
    margins.push_back(run.margin);
    if (!run.failed) continue;
    if (faulty) ++kinds[std::get<std::string>(values.at("fault.kind"))];
    if (++failed > kShown) continue;
    std::printf("margin %.3f ", run.margin);
    print(values);
    print_neighbour(bug, base, values);
  }
  const double took_ms = 1e3 * static_cast<double>(computing) / CLOCKS_PER_SEC;
  std::ranges::sort(margins);
  const auto at = [&](double share) {
    return margins[static_cast<std::size_t>(share * static_cast<double>(margins.size() - 1))];
  };
  std::printf("%s: %d of %d fail, %d fired, %.2f ms each\n", bug.name.c_str(), failed, cases, fired,
              took_ms / cases);
  std::printf(
      "  margins: least %.3f, 0.1 %% %.3f, 0.3 %% %.3f, 1 %% %.3f, 3 %% %.3f, 10 %% %.3f, half "
      "%.3f, most %.3f\n",
      at(0), at(0.001), at(0.003), at(0.01), at(0.03), at(0.1), at(0.5), at(1));
  for (const auto& [kind, count] : kinds) std::printf("  %d %s\n", count, kind.c_str());
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace lk::emulator::planted

int main(int argc, char** argv) {
  using namespace lk::emulator::planted;
  if (argc < 3) {
    std::fprintf(stderr, "planted_sweep BUG CASES [SEED] [nofault]\n");
    return 2;
  }
  for (const Bug& bug : all_bugs()) {
    if (bug.name == argv[1]) {
      return sweep(bug, std::atoi(argv[2]), argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1,
                   argc <= 4);
    }
  }
  std::fprintf(stderr, "no bug %s\n", argv[1]);
  return 2;
}

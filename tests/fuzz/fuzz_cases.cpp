// Lines of cases: each is refused in one line, or it runs, and gives the same alone and in company.
//
// Input: lines of JSON (docs/reference/formats.md). `scenario` is a shipped one, which is checked;
// what runs is short.toml.

#include <cstddef>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/config/scenario/config_scenario.hpp"
#include "tests/fuzz/shipped.hpp"
#include "tests/fuzz/support.hpp"
#include "tools/cases/case_batch.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

constexpr std::size_t kMaxCases = 12;  // more than the lanes that are computed together

using Results = std::map<std::string, int>;  // lines, and how often

Results results(std::span<const CaseRequest> requests, bool check) {
  Results all;
  std::size_t count = 0;
  bool impossible = false;
  CaseBatch batch;
  const bool possible = batch.run(requests, check, [&](const std::string& lines) {
    require(lines.ends_with('\n'));
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line); ++count) {
      const Json result = Json::parse(line);
      require(result.at("case").is_number_unsigned());
      impossible = impossible || result.contains("error");
      ++all[line];
    }
  });
  require(count == requests.size());
  require(possible != impossible);
  return all;
}

/// The case as a file is a scenario.
void check_file(const CaseRequest& request) {
  std::string text;
  try {
    CaseBuilder builder;
    CaseBuilder::fault(request, builder.course(request).scenario);
    text = builder.file_text(request);
  } catch (const std::exception&) {
    return;  // an impossible case
  }
  CaseFiles files(std::filesystem::path(request.scenario).parent_path());
  parse_scenario(text, "case.toml", std::nullopt, files.files());
}

void check(const std::string& text) {
  std::vector<CaseRequest> requests;
  std::istringstream stream(text);
  for (std::string line; requests.size() < kMaxCases && std::getline(stream, line);) {
    try {
      requests.push_back(read_case(parse_json(line)));
    } catch (const JsonError& problem) {
      require(*problem.what() != '\0');
      continue;
    } catch (const ConfigError& problem) {
      fuzz::require_one_line(problem.what());
      continue;
    }
    CaseRequest& request = requests.back();
    if (fuzz::plain_name(request.scenario)) {
      request.scenario = LKEMU_SOURCE_DIR "/configs/scenarios/" + request.scenario + ".toml";
      results({&request, 1}, true);
    }
    request.scenario = LKEMU_SOURCE_DIR "/tests/fuzz/short.toml";
    check_file(request);
  }
  Results alone;
  for (const CaseRequest& request : requests) {
    for (const auto& [line, times] : results({&request, 1}, false)) alone[line] += times;
  }
  require(results(requests, false) == alone);
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({reinterpret_cast<const char*>(data), size});
  return 0;
}

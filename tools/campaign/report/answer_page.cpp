#include "tools/campaign/report/answer_page.hpp"

#include <array>
#include <stdexcept>
#include <string_view>

#include "emulator/ground/text.hpp"
#include "tools/campaign/report/answer_json.hpp"
#include "tools/campaign/report/page_files.hpp"

namespace lk::emulator {
namespace {

constexpr std::array<std::string_view, 2> kStyles = {"/web/style.css",
                                                     "/tools/campaign/report/page/page.css"};
// One module: names of earlier files are there in later ones.
constexpr std::array<std::string_view, 8> kScripts = {"/web/dom.js",
                                                      "/web/words_zh_faults.js",
                                                      "/tools/campaign/report/page/words.js",
                                                      "/tools/campaign/report/page/parts.js",
                                                      "/tools/campaign/report/page/heat_maps.js",
                                                      "/tools/campaign/report/page/figures.js",
                                                      "/tools/campaign/report/page/cases.js",
                                                      "/tools/campaign/report/page/page.js"};

std::string_view page_part(std::string_view path) {
  const EmbeddedFile* const file = find_page_file(path);
  if (!file) throw std::logic_error("the page has no part " + std::string(path));
  return file->body;
}

template <std::size_t kCount>
std::string joined(const std::array<std::string_view, kCount>& paths) {
  std::string text;
  for (const std::string_view path : paths) text += page_part(path);
  return text;
}

/// JSON that no end of a script, and no comment, can be in: "<" is in strings only.
std::string json_for_script(const std::string& json) {
  std::string safe;
  safe.reserve(json.size() + json.size() / 16);
  for (const char c : json) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace

std::string answer_page(const Answer& answer, const std::vector<ThresholdResult>& thresholds,
                        const Comparison* comparison) {
  std::string page;
  std::string_view rest = page_part("/tools/campaign/report/page/page.html");
  // {{name}} in the page is where a part comes; parts are not searched for any themselves.
  for (std::size_t at = rest.find("{{"); at != std::string_view::npos; at = rest.find("{{")) {
    page += rest.substr(0, at);
    rest.remove_prefix(at + 2);
    const std::size_t end = rest.find("}}");
    const std::string_view name = rest.substr(0, end);
    rest.remove_prefix(end + 2);
    if (name == "title") page += xml_escaped(answer.head.plan_name);
    if (name == "styles") page += joined(kStyles);
    if (name == "data") page += json_for_script(answer_json(answer, thresholds, comparison));
    if (name == "scripts") page += joined(kScripts);
  }
  return page += rest;
}

}  // namespace lk::emulator

#include "tools/campaign/hosts/host_verdict.hpp"

#include <cmath>
#include <utility>

namespace lk::emulator {
namespace {

SimTime time_of(const Json& seconds) { return SimTime(std::llround(seconds.get<double>() * 1e9)); }

std::optional<SimTime> time_at(const Json& json, const char* key) {
  const Json& seconds = json.at(key);
  return seconds.is_null() ? std::nullopt : std::optional(time_of(seconds));
}

std::string renamed(std::string text, const std::string& name, const std::string& kind) {
  if (const auto at = text.find(name); at != std::string::npos) text.replace(at, name.size(), kind);
  return text;
}

HostExpectation expectation(const Json& json) {
  HostExpectation one{json.at("says"),
                      json.at("expected"),
                      json.at("measured"),
                      json.at("status") == "passed",
                      time_at(json, "decided_at_s"),
                      std::nullopt};
  if (!json.at("margin").is_null()) one.margin = json.at("margin").get<double>();
  return one;
}

HostFault fault(const Json& json) {
  return {json.at("name"),
          json.at("kind"),
          time_at(json, "began_at_s"),
          time_at(json, "first_effect_at_s"),
          json.at("effects"),
          json.at("first_on")};
}

}  // namespace

HostVerdict host_verdict(const Json& json, const std::string& kind) {
  HostVerdict verdict;
  const Json& bus = json.at("buses").at(0);
  const std::string name = bus.at("bus");
  verdict.outcome = json.at("state");
  for (const Json& one : json.at("expectations")) {
    verdict.expectations.push_back(expectation(one));
    std::string& expected = verdict.expectations.back().expected;
    expected = renamed(std::move(expected), name, kind);
  }
  for (const Json& one : json.at("faults")) verdict.faults.push_back(fault(one));
  for (const Json& one : json.at("errors")) {
    verdict.errors.push_back({one.at("id"), one.at("error"), time_of(one.at("at_s"))});
  }
  for (const Json& one : json.at("invalid")) {
    verdict.invalid.push_back(renamed(one, name, kind));
  }
  verdict.replies = bus.at("replies");
  verdict.replies_hash = bus.at("replies_hash");
  return verdict;
}

}  // namespace lk::emulator

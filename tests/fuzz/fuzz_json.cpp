// Requests to the control interface without HTTP: a path and a JSON body. Every request gets one
// answer, without internal errors; a refusal leaves the bus unchanged.
//
// Input: lines of requests, "METHOD PATH BODY". Simulated time advances by 1 ms between requests.

#include <spdlog/spdlog.h>

#include <cstddef>
#include <string>

#include "emulator/io/program/scenario_activity.hpp"
#include "tests/emulator/control/control_support.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

constexpr int kMaxRequests = 20;  // limits an input to milliseconds

std::string take_until(std::string_view& text, char end) {
  const std::size_t size = text.find(end);
  std::string part(text.substr(0, size));
  text.remove_prefix(size == std::string_view::npos ? text.size() : size + 1);
  return part;
}

class Clients {
 public:
  Clients() {
    t_.api.scenario = scenario_.for_clients();
    // Does not read files of this machine.
    t_.api.scenario.start = [start = t_.api.scenario.start](TableReader& request, bool same_user) {
      if (request.has("file")) throw ApiError(400, "file", "none here");
      return start(request, same_user);
    };
  }

  void ask(std::string_view line) {
    ApiRequest request;
    request.method = take_until(line, ' ');
    request.path = "/api/v1" + take_until(line, ' ');
    request.content_type = "application/json";
    request.body = line;
    const std::size_t faults = line_().bus().faults().size();
    int answers = 0;
    int status = 0;
    t_.loop.restart();
    t_.api.handle(request, [&](const ApiResponse& response) {
      ++answers;
      status = response.status;
      require(!response.body.dump(-1, ' ', false, Json::error_handler_t::replace).empty());
    });
    t_.api.abandon();  // ends an advance of days, as a disconnection does
    // A running clock always lags here, so the loop would never become idle.
    t_.world.set_clock({.stepped = true});
    t_.loop.poll();
    require(answers == 1 && status != 500);
    require(status == 200 || line_().bus().faults().size() == faults);
    line_().advance_to(line_().bus().time() + std::chrono::milliseconds(1), MonoTime::max(),
                       Line::WaitPolicy::kNone);
  }

 private:
  Line& line_() { return *t_.world.lines().front(); }

  TestWorld t_;
  ScenarioActivity scenario_{t_.loop, t_.world};
};

void check(std::string_view text) {
  spdlog::set_level(spdlog::level::off);
  Clients clients;
  for (int n = 0; n < kMaxRequests && !text.empty(); ++n) clients.ask(take_until(text, '\n'));
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({reinterpret_cast<const char*>(data), size});
  return 0;
}

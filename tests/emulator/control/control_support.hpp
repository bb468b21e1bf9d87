#pragma once

/// @file A world without interfaces, and requests to it.

#include <boost/asio/io_context.hpp>
#include <optional>
#include <string>
#include <utility>

#include "emulator/io/control/control_api.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {

/// By default two buses: "vcan0" with drives 1 and 2, and "vcan1" with drive 1.
struct TestWorld {
  // The electronics discharge the link from 24 V to 5 V in C (24² − 5²) / (2 · 2.4 W) = 54 ms.
  static void let_it_draw(BusConfig& config) {
    for (ServoConfig& servo : config.servos) servo.profile.drive.supply.i_logic = 0.1;
  }

  explicit TestWorld(ClockMode mode = {.stepped = true}, int buses = 1) : world(loop, mode) {
    BusConfig first = test::bus_config({1, 2}, 1'000'000);
    first.interface = "vcan0";
    let_it_draw(first);
    world.add(first);
    if (buses > 1) {
      BusConfig second = test::bus_config({1}, 1'000'000);
      second.interface = "vcan1";
      let_it_draw(second);
      world.add(second);
    }
    world.start();
  }

  /// A world with only this bus and a stepped clock.
  explicit TestWorld(const BusConfig& only) : world(loop, {.stepped = true}) {
    world.add(only);
    world.start();
  }

  ApiResponse ask(const ApiRequest& request) {
    std::optional<ApiResponse> response;
    loop.restart();
    api.handle(request, [&](const ApiResponse& answer) { response = answer; });
    while (!response && loop.run_one() > 0) {
    }
    return response.value_or(ApiResponse{});
  }
  ApiResponse get(const std::string& path) { return ask({"GET", "/api/v1" + path, {}, "", ""}); }
  ApiResponse send(const std::string& method, const std::string& path, const std::string& body) {
    return ask({method, "/api/v1" + path, {}, "application/json", body});
  }
  ApiResponse post(const std::string& path, const std::string& body) {
    return send("POST", path, body);
  }

  boost::asio::io_context loop{1};
  World world;
  ControlApi api{world};
};

inline std::string where(const ApiResponse& response) {
  return response.body.value("error", Json::object()).value("where", "");
}
inline std::string reason(const ApiResponse& response) {
  return response.body.value("error", Json::object()).value("reason", "");
}

}  // namespace lk::emulator

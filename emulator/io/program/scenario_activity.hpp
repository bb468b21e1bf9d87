#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <optional>

#include "emulator/io/control/control_api.hpp"
#include "emulator/io/program/live_scenario.hpp"

namespace lk::emulator {

/// The scenario of a running program, from the command line or a client; one at a time.
class ScenarioActivity {
 public:
  ScenarioActivity(boost::asio::io_context& loop, World& world) : loop_(loop), world_(world) {}

  /// Throws std::invalid_argument if a bus has no room for the scenario's faults. Starts nothing.
  void check_room(const Scenario& scenario) const;
  /// Starts a scenario; ends an earlier one. Calls `on_over`, if any, from the loop at its end.
  /// Throws std::invalid_argument if a bus has no room for its faults.
  void start(Scenario scenario, std::function<void()> on_over);
  void finish();
  /// Report of the present or last scenario; nullopt before the first.
  std::optional<RunReport> report() const;

  /// Limit for a scenario file that a client names, bytes: the loop of the drives waits while it is
  /// read. Same as kLongestBody.
  static constexpr std::uintmax_t kLongestFile = 65'536;
  /// Returns functions for clients: start a scenario from a "file" or a text "toml", query and stop
  /// it.
  Activity for_clients();

 private:
  std::vector<Line*> lines() const;
  Json start_for_client(TableReader& request, bool same_user);
  Json state() const;
  Json report_json() const;

  boost::asio::io_context& loop_;
  World& world_;
  std::optional<LiveScenario> live_;
  unsigned number_ = 0;   // of the present scenario
  bool planned_ = false;  // the present scenario is that of --scenario
};

}  // namespace lk::emulator

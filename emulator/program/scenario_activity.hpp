#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <optional>

#include "emulator/control/control_api.hpp"
#include "emulator/scenario/live_scenario.hpp"

namespace lk::emulator {

/// The scenario of a running program, one at a time: of its command line, or of a client.
class ScenarioActivity {
 public:
  ScenarioActivity(boost::asio::io_context& loop, World& world) : loop_(loop), world_(world) {}

  /// Throws std::invalid_argument when a bus has no room for its faults. Begins nothing.
  void check_room(const Scenario& scenario) const;
  /// `on_over` is called from the loop when it has come to its end. Throws std::invalid_argument.
  void start(Scenario scenario, std::function<void()> on_over);
  void finish();
  /// Of the one that runs, or ran last; none before the first.
  std::optional<RunReport> report() const;

  /// A client's file is read on the loop of the drives: as much as a request may have.
  static constexpr std::uintmax_t kLongestFile = 65'536;
  /// What clients can do: start one that they name ("file") or send ("toml"), look, and stop it.
  Activity for_clients();

 private:
  std::vector<Line*> lines() const;
  Json start_for_client(const Json& request, bool same_user);
  Json state() const;
  Json report_json() const;

  boost::asio::io_context& loop_;
  World& world_;
  std::optional<LiveScenario> live_;
  unsigned number_ = 0;   // of the present one
  bool planned_ = false;  // the present one is what the program runs for
};

}  // namespace lk::emulator

#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/files/output_file.hpp"
#include "emulator/files/rom_store.hpp"
#include "emulator/io/control/control_server.hpp"
#include "emulator/io/live/world.hpp"
#include "emulator/io/program/answered_ids.hpp"
#include "emulator/io/program/process.hpp"
#include "emulator/io/program/run_recording.hpp"
#include "emulator/io/program/scenario_activity.hpp"
#include "emulator/io/shafts/shaft_server.hpp"
#include "emulator/io/transports/netlink.hpp"

namespace lk::emulator {

/// Options of a run.
struct RunOptions {
  bool create_buses = false;
  bool real_bus = false;  // also allow CAN interfaces that are not virtual
  RomOptions rom;
  ClockMode clock;
  ControlOptions control;
  std::optional<ShaftOptions> shafts;  // address for an external simulator
  std::optional<Scenario> scenario;    // starts when the interfaces are up; the run ends with it
  std::optional<std::filesystem::path> junit;
  std::optional<std::filesystem::path> record;  // directory for a recording from the beginning
  Language language = Language::kEnglish;       // of advice
  bool strict = false;                          // advice counts as a failure
  bool end_with_input = false;                  // end when standard input ends
  // Configuration texts and overrides of the buses, for recordings.
  Overrides overrides;
  ConfigTexts texts;
};

/// The running program: buses on their interfaces, paced by the clock, in one thread and one event
/// loop. Only disk access uses other threads.
class Daemon {
 public:
  /// Throws StartError if an interface, an ID, the ROM or a control address is not available.
  Daemon(std::vector<BusConfig> buses, const RunOptions& options);

  /// Runs until SIGINT, SIGTERM, the end of the scenario, or of a watched standard input. Then
  /// waits briefly for the disk and prints the summary. Returns the exit status: 0, or that of the
  /// scenario's verdict; 1 after advice if strict. If the disk has not finished by then, ends the
  /// process with this status instead of returning.
  int run();

 private:
  void keep_rom(std::size_t line, const RomWrite& write);
  /// Can be called from any thread.
  void post_rom_result(const RomFile& place, const RomWrite& write, int error);
  void begin_stop();
  void wait_to_end();
  bool rom_is_settled() const;
  bool disk_is_done() const { return rom_is_settled() && recording_.done(); }
  bool replies_have_left() const;
  void follow_links();
  void report_ready_once();
  void print_summary() const;
  std::vector<GivenAdvice> advice() const;
  void print_advice() const;
  /// Report of the scenario of this run.
  RunReport judged_report() const;
  /// Prints the verdict, if any; returns the exit status.
  int conclude_scenario();

  AnsweredIds answered_ids_;
  boost::asio::io_context loop_{1};
  World world_;
  ScenarioActivity scenario_;
  RunRecording recording_;
  std::optional<Scenario> planned_;  // starts when the interfaces are up
  bool judged_ = false;  // the run is for a scenario, whose verdict gives the exit status
  Language language_;
  bool strict_;
  std::optional<OutputFile> junit_;
  LinkMonitor links_;
  boost::asio::signal_set signals_;
  std::optional<InputWatch> input_;
  boost::asio::steady_timer shutdown_timer_;  // at the end: polls the disk, then the interfaces
  bool stopping_ = false;
  MonoTime disk_deadline_{};
  MonoTime flush_deadline_{};
  MonoTime started_;
  bool ready_ = false;
  std::optional<RomStore> rom_store_;  // absent: ROM contents are lost at the end
  std::optional<ControlServer> control_;
  std::optional<ShaftServer> shafts_;
  RomWriter rom_writer_;  // last: its thread ends before members that it uses
};

}  // namespace lk::emulator

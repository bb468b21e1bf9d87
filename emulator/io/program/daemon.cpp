#include "emulator/io/program/daemon.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/io/program/answered_ids.hpp"
#include "emulator/io/program/config_listing.hpp"
#include "emulator/io/program/process.hpp"
#include "emulator/io/transports/port.hpp"
#include "emulator/io/transports/socketcan.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"

namespace lk::emulator {
namespace {

/// Time-out for the disk at the end of the run. Later, unfinished writes to ROM may be lost; their
/// replies were not sent.
constexpr auto kShutdownTimeout = std::chrono::seconds(3);
/// Time-out for the interfaces after that for the disk. In this time a CAN bus at full load sends
/// all the replies that a port queues.
constexpr auto kFlushTimeout = std::chrono::milliseconds(150);
constexpr auto kShutdownPoll = std::chrono::milliseconds(2);

void check_can_support() {
  const std::string problem = can_problem();
  if (!problem.empty()) {
    throw StartError(problem + ": try " + offer_without_can() +
                     "; or sudo modprobe can-raw vcan, or run it under scripts/with-vcan");
  }
}

void make(const std::string& interface) {
  try {
    create_vcan(interface);
  } catch (const std::system_error& problem) {
    const int error = problem.code().value();
    if (error == EPERM || error == EACCES) {
      throw StartError("no permission to make " + interface +
                       ": --create-bus needs root or CAP_NET_ADMIN");
    }
    if (error == EOPNOTSUPP) {
      throw StartError("cannot make " + interface +
                       ": this kernel has no vcan (sudo modprobe vcan)");
    }
    if (link_state(interface).index != 0) {
      throw StartError("cannot bring up " + interface + " (" + problem.code().message() +
                       "); set its bit rate first: sudo ip link set " + interface +
                       " type can bitrate 1000000");
    }
    throw StartError("cannot make " + interface + ": " + problem.code().message());
  }
}

void check_interface(const std::string& interface, const LinkState& link, Interfaces allowed) {
  if (link.index == 0) {
    throw StartError("interface not found: " + interface + "; create it with: sudo ip link add " +
                     interface + " type vcan && sudo ip link set " + interface +
                     " up (or start with --create-bus)");
  }
  if (!link.is_can) throw StartError(interface + " is not a CAN interface");
  if (!link.is_virtual() && allowed == Interfaces::kVirtualOnly) {
    throw StartError(
        interface +
        " is not virtual (vcan, vxcan): real drives may be on it, and one with the same ID would "
        "answer too; if no drive on it has these IDs, start with --real-bus");
  }
}

bool is_socketcan(const BusConfig& bus) {
  return scheme_of(bus.interface).transport == Transport::kSocketCan;
}

/// Prints a counter unless it is 0: zeros would hide the important numbers.
void print_nonzero(const char* what, std::uint64_t count) {
  if (count > 0) std::printf("    %-44s %10" PRIu64 "\n", what, count);
}

void print_bus(const BusStats& bus, const std::string& title) {
  std::printf("  %-46s %10" PRIu64 " frames, %" PRIu64 " queries, %" PRIu64 " replies\n",
              title.c_str(), bus.frames, bus.queries, bus.replies);
  for (std::size_t cause = 0; cause < protocol::kRejects; ++cause) {
    print_nonzero(
        ("not answered: " + std::string(to_string(static_cast<protocol::Reject>(cause)))).c_str(),
        bus.dropped[cause]);
  }
  print_nonzero("times that no node acknowledged frames of hosts", bus.unacknowledged);
  print_nonzero("queued frames of hosts that were sent later", bus.replayed);
  print_nonzero("of these: older than 100 ms", bus.stale);
  print_nonzero("replies lost: with the power or by a fault",
                bus.replies_lost - bus.replies_collided - bus.replies_overrun);
  print_nonzero("replies lost: in collisions on the line", bus.replies_collided);
  print_nonzero("replies lost: the hosts' adapter was full", bus.replies_overrun);
  print_nonzero("unrequested frames of drives", bus.extra_frames);
  print_nonzero("error frames", bus.error_frames);
  print_nonzero("RS-485: bytes that start no packet", bus.receiver.skipped_bytes);
  print_nonzero("RS-485: headers whose sum is wrong", bus.receiver.bad_headers);
  print_nonzero("RS-485: packets longer than any", bus.receiver.too_long);
  print_nonzero("RS-485: packets whose sum is wrong", bus.receiver.bad_data);
  print_nonzero("RS-485: packets broken off", bus.receiver.incomplete_packets);
  print_nonzero("motion not executed: drive off or in error", bus.refused_motion);
  print_nonzero("motion not executed: target out of range", bus.invalid_targets);
  print_nonzero("writes to ROM", bus.rom_writes);
}

void print_gate(const RomGate& gate) {
  print_nonzero("writes to ROM that failed: not kept", gate.failed_writes());
  print_nonzero("replies not sent: not kept in ROM", gate.lost_replies());
  print_nonzero("drives whose last ROM write is not confirmed", gate.waiting());
}

void print_port(const PortStats& port) {
  print_nonzero("replies lost: interface down", port.lost_link_down);
  print_nonzero("replies lost: send queue full", port.lost_queue_full);
  print_nonzero("replies lost: still in the send queue at the end", port.pending);
  print_nonzero("waits for the send queue", port.waits_for_queue);
  print_nonzero("frames dropped by the kernel", port.kernel_drops);
  print_nonzero("times the interface went down or away", port.link_losses);
  print_nonzero("frames lost: a client did not read", port.lost_unread);
  print_nonzero("lines or datagrams that made no sense", port.malformed);
  print_nonzero("datagrams of others, dropped", port.foreign);
  print_nonzero("clients refused: no room", port.refused);
}

/// Calls `act`; turns an error of the scenario into a StartError that names the option.
void with_scenario(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--scenario: ") + problem.what());
  }
}

/// Returns the paths at which this run writes, creates sockets or opens serial ports.
std::vector<std::filesystem::path> addresses_of(const RunOptions& options,
                                                const std::vector<BusConfig>& buses) {
  std::vector<std::filesystem::path> places;
  for (const BusConfig& bus : buses) {
    const BusName name = bus_name(bus.interface);
    if (name.scheme->place == BusPlace::kPath) places.emplace_back(name.path);
  }
  const std::string& socket = options.control.socket;
  if (!socket.empty() && socket != "none") places.emplace_back(socket);
  if (options.shafts && !options.shafts->path.empty()) places.emplace_back(options.shafts->path);
  for (const auto& place : {options.rom.directory, options.record, options.junit}) {
    if (place) places.push_back(*place);
  }
  return places;
}

}  // namespace

Daemon::Daemon(std::vector<BusConfig> buses, const RunOptions& options)
    : world_(loop_, options.clock),
      scenario_(loop_, world_),
      recording_(world_, options.overrides, options.texts),
      planned_(options.scenario),
      judged_(options.scenario.has_value()),
      language_(options.language),
      strict_(options.strict),
      links_(loop_, [this] { follow_links(); }),
      signals_(loop_, SIGINT, SIGTERM),
      shutdown_timer_(loop_),
      started_(monotonic_now()),
      rom_writer_([this](const RomFile& place, const RomWrite& write, int error) {
        post_rom_result(place, write, error);
      }) {
  if (std::ranges::any_of(buses, is_socketcan)) check_can_support();
  const auto allowed = options.real_bus ? Interfaces::kAll : Interfaces::kVirtualOnly;
  // Checks all existing interfaces and paths before it creates or brings up any.
  for (const BusConfig& bus : buses) {
    LinkState link;
    if (is_socketcan(bus)) {
      link = link_state(bus.interface);
      if (link.index != 0 || !options.create_buses) check_interface(bus.interface, link, allowed);
    } else {
      link.name = place_of(bus.interface);
    }
    answered_ids_.take(bus, link);
    if (!is_socketcan(bus)) check_place(bus.interface);
  }
  const bool keeps_rom = !options.rom.in_memory;
  if (keeps_rom) rom_store_.emplace(options.rom, buses);
  if (options.junit) junit_.emplace(*options.junit, "--junit");
  for (std::size_t i = 0; i < buses.size(); ++i) {
    Line& line = world_.add(buses[i]);  // `buses[i]` has the ROM contents of its drives
    answered_ids_.start(line);
    line.on_address_change = [this, &line] { answered_ids_.update(line); };
    line.on_advice = [this, &line](const Advice& advice) {
      // No warning: a host may send an unknown command once, to probe a drive.
      const bool may_be_right = advice.found.kind == AdviceKind::kUnknownCommand;
      spdlog::log(may_be_right ? spdlog::level::info : spdlog::level::warn, "{}",
                  advice_line(line.name(), advice, language_));
    };
    if (keeps_rom) line.on_rom_write = [this, i](const RomWrite& write) { keep_rom(i, write); };
  }
  if (options.end_with_input) {
    input_.emplace(loop_, [this] {
      spdlog::info("standard input has ended: stopping");
      begin_stop();
    });
  }
  if (planned_) with_scenario([this] { scenario_.check_room(*planned_); });
  control_.emplace(loop_, world_, options.control);
  if (options.shafts && Coupling::needed(buses)) {
    throw StartError(
        "--shafts: the drives of this robot have a [body] or a battery in common already");
  }
  if (options.shafts) shafts_.emplace(loop_, world_, *options.shafts);
  for (const BusConfig& bus : buses) {
    if (options.create_buses && is_socketcan(bus)) make(bus.interface);
  }
  for (std::size_t i = 0; i < buses.size(); ++i) {
    world_.lines()[i]->connect(loop_, allowed, [this, i] { world_.serve(i); });
    world_.lines()[i]->port()->check_link();  // opens the interface, if it is up
  }
  // Enlarging the receive buffers above was the last step that needs a capability.
  give_up_privileges(addresses_of(options, buses));
  // Only now: a start that fails must not leave a directory with files.
  if (options.record) recording_.start(*options.record, RunRecording::From::kBeginning);
  // Last, as a wipe cannot be undone if the start fails.
  if (keeps_rom && options.rom.wipe) rom_store_->wipe();
  for (const BusConfig& bus : buses) {
    for (const std::string& line : protocol_summary(bus)) spdlog::info("{}", line);
  }
  for (const std::string& line : generation_hints(buses)) spdlog::info("{}", line);
  control_->api().scenario = scenario_.for_clients();
  // Does not record with a shaft port: a recording would not contain the simulator's torques.
  if (!shafts_) control_->api().recording = recording_.for_clients();
}

int Daemon::run() {
  // The first signal ends the program with time-outs; the second one ends it at once.
  signals_.async_wait([this](const auto& /*error*/, int /*signal*/) {
    signals_.async_wait([this](const auto& /*error*/, int /*signal*/) { loop_.stop(); });
    begin_stop();
  });
  started_ = monotonic_now();
  world_.start();
  if (shafts_) shafts_->start();
  follow_links();
  if (!ready_) notify_service_manager("STATUS=waiting for an interface to be up");
  loop_.run();
  print_summary();
  if (!judged_) print_advice();
  const int status = conclude_scenario();
  if (!disk_is_done()) {
    // A writer's thread may block in a system call without limit. Ending the process has the effect
    // of a power cut: an unfinished file keeps its old content.
    control_.reset();
    shafts_.reset();
    spdlog::default_logger()->flush();
    std::fflush(nullptr);
    std::_Exit(status);
  }
  return status;
}

RunReport Daemon::judged_report() const {
  if (auto report = scenario_.report()) return *std::move(report);
  RunReport report;
  report.name = planned_->name;
  report.about = planned_->about;
  report.seed = planned_->robot.front().seed;
  for (const BusConfig& bus : planned_->robot) report.drives += bus.servos.size();
  report.verdict.outcome = Outcome::kInvalid;
  report.verdict.invalid = {"the scenario never began, an interface was down"};
  return report;
}

int Daemon::conclude_scenario() {
  if (!judged_) return strict_ && !advice().empty() ? EXIT_FAILURE : EXIT_SUCCESS;
  RunReport report = judged_report();
  report.advice = advice();
  report.strict = strict_;
  std::fputs(report_text(report, false, language_).c_str(), stdout);
  std::fflush(stdout);
  if (!junit_) return exit_status(report.outcome());
  try {
    junit_->write(junit_xml({report}));
    junit_->commit();
  } catch (const StartError& problem) {
    // Printed here: an exception would destroy the writers, and so wait for their threads and disk.
    std::fprintf(stderr, "lk-emu: %s\n", problem.what());
    return 2;
  }
  return exit_status(report.outcome());
}

std::vector<GivenAdvice> Daemon::advice() const {
  std::vector<GivenAdvice> all;
  for (const auto& line : world_.lines()) {
    for (const Advice& advice : line->adviser().advice()) all.push_back({line->name(), advice});
  }
  return all;
}

/// Prints to standard error, as programs parse the summary on standard output. For runs without a
/// scenario: its report contains the advice.
void Daemon::print_advice() const {
  const std::vector<GivenAdvice> all = advice();
  if (all.empty()) return;
  constexpr BilingualText kTitle{"advice about the host:", "对主机的建议："};
  std::string text = std::string(kTitle.in(language_)) + '\n';
  for (const auto& [bus, advice] : all) text += "  " + advice_line(bus, advice, language_) + '\n';
  for (const auto& line : world_.lines()) {
    if (const std::uint64_t more = line->adviser().left_out()) {
      constexpr BilingualText kMore{" times more, of causes that are not listed",
                                    " 次，原因未列出"};
      text += "  " + line->name() + ": " + std::to_string(more);
      text += std::string(kMore.in(language_)) + '\n';
    }
  }
  std::fputs(text.c_str(), stderr);
}

void Daemon::keep_rom(std::size_t line, const RomWrite& write) {
  rom_writer_.write(rom_store_->place(line, write.id), write);
}

void Daemon::post_rom_result(const RomFile& place, const RomWrite& write, int error) {
  boost::asio::post(loop_, [this, bus = place.bus, write, error] {
    world_.lines()[bus]->settle_rom(write, error);
  });
}

bool Daemon::rom_is_settled() const {
  return std::ranges::all_of(world_.lines(), [](const auto& line) { return line->gate().idle(); });
}

bool Daemon::replies_have_left() const {
  return std::ranges::all_of(world_.lines(),
                             [](const auto& line) { return line->port()->stats().pending == 0; });
}

/// Stops the buses, then waits for the disk, so that replies to writes that it finishes in time are
/// still sent.
void Daemon::begin_stop() {
  if (std::exchange(stopping_, true)) return;
  notify_service_manager("STOPPING=1");
  scenario_.finish();
  world_.stop();
  recording_.stop();
  disk_deadline_ = monotonic_now() + kShutdownTimeout;
  flush_deadline_ = disk_deadline_ + kFlushTimeout;
  wait_to_end();
}

void Daemon::wait_to_end() {
  const MonoTime now = monotonic_now();
  const bool done_with_disk = disk_is_done() || now >= disk_deadline_;
  if (done_with_disk) flush_deadline_ = std::min(flush_deadline_, now + kFlushTimeout);
  if (done_with_disk && (replies_have_left() || now >= flush_deadline_)) {
    loop_.stop();
    return;
  }
  shutdown_timer_.expires_after(kShutdownPoll);
  shutdown_timer_.async_wait([this](const auto& /*error*/) { wait_to_end(); });
}

void Daemon::follow_links() {
  for (auto& line : world_.lines()) line->port()->check_link();
  answered_ids_.drain_queue();
  report_ready_once();
}

void Daemon::report_ready_once() {
  const bool all_up =
      std::ranges::all_of(world_.lines(), [](const auto& line) { return line->is_up(); });
  if (ready_ || !all_up) return;
  ready_ = true;
  std::string text = "ready";
  for (const auto& line : world_.lines())
    text += " " + line->name() + ":" + line->ids() + moved_text(*line);
  std::printf("lk-emu %s\n", text.c_str());
  std::fflush(stdout);
  notify_service_manager("READY=1\nSTATUS=" + text);
  if (!planned_) return;
  // Checked again, as clients may have added faults while an interface was down.
  with_scenario([this] { scenario_.start(std::move(*planned_), [this] { begin_stop(); }); });
  planned_.reset();
}

void Daemon::print_summary() const {
  std::printf("lk-emu stopped after %.1f s\n", in_seconds(monotonic_now() - started_));
  for (const auto& line : world_.lines()) {
    print_bus(line->bus().stats(), line->name() + ":" + line->ids());
    print_gate(line->gate());
    print_port(line->port()->stats());
    print_nonzero("frames lost while time was stopped", line->backlog_lost());
    print_nonzero("frames still waiting for the stepped clock", line->backlog());
  }
  const SimClock& clock = world_.clock();
  if (clock.slips() > 0) {
    std::printf("simulated time slipped %" PRIu64 " time%s, %.3f s in all\n", clock.slips(),
                clock.slips() == 1 ? "" : "s", in_seconds(clock.total_slip()));
  }
  std::fflush(stdout);
}

}  // namespace lk::emulator

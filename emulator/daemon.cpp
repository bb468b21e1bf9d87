#include "emulator/daemon.hpp"

#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <system_error>

#include "emulator/cli.hpp"

namespace lk::emulator {
namespace {

/// The model is advanced at least this often, so that a query never finds much to catch up with.
constexpr MonoTime kLongestSleep = std::chrono::milliseconds(1);
/// How long the end waits for the disk. A write that was not acknowledged may be lost.
constexpr auto kLongestGoodbye = std::chrono::seconds(3);
/// And then for the interfaces: as long as a full bus takes for all that a port holds.
constexpr auto kLongestFlush = std::chrono::milliseconds(150);
constexpr auto kGoodbyeStep = std::chrono::milliseconds(2);

/// "1-4,7"
std::string print_ids(const std::vector<ServoConfig>& servos) {
  std::string text;
  for (std::size_t i = 0; i < servos.size();) {
    std::size_t last = i;
    while (last + 1 < servos.size() && servos[last + 1].id == servos[last].id + 1) ++last;
    if (i > 0) text += ',';
    text += std::to_string(servos[i].id);
    if (last > i) text += '-';
    if (last > i) text += std::to_string(servos[last].id);
    i = last + 1;
  }
  return text;
}

void check_can_support() {
  const int fd = ::socket(PF_CAN, SOCK_RAW, 1);
  if (fd >= 0) {
    ::close(fd);
    return;
  }
  if (errno == EPERM || errno == EACCES) throw StartError("no permission to open a CAN socket");
  throw StartError(
      "this kernel has no CAN sockets: sudo modprobe can-raw vcan, or run it under "
      "scripts/with-vcan");
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

void check_interface(const std::string& interface) {
  const LinkState link = link_state(interface);
  if (link.index == 0) {
    throw StartError("there is no interface " + interface + "; make it with: sudo ip link add " +
                     interface + " type vcan && sudo ip link set " + interface +
                     " up (or start with --create-bus)");
  }
  if (!link.is_can) throw StartError(interface + " is not a CAN interface");
}

Reception reception_for(const BusConfig& bus) {
  return bus.bitrate == 0 ? Reception::kDriveFrames : Reception::kEverything;
}

double in_seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

/// Only what happened: a column of zeros hides the one number that matters.
void print_nonzero(const char* what, std::uint64_t count) {
  if (count > 0) std::printf("    %-44s %10" PRIu64 "\n", what, count);
}

void print_bus(const BusStats& bus, const std::string& title) {
  std::printf("  %-46s %10" PRIu64 " frames, %" PRIu64 " queries, %" PRIu64 " replies\n",
              title.c_str(), bus.frames, bus.queries, bus.replies);
  for (std::size_t cause = 0; cause < kDropKinds; ++cause) {
    print_nonzero(("not answered: " + std::string(to_string(static_cast<Drop>(cause)))).c_str(),
                  bus.dropped[cause]);
  }
  print_nonzero("replies lost: with the power or by a fault", bus.replies_lost);
  print_nonzero("frames of drives that nobody asked for", bus.extra_frames);
  print_nonzero("error frames", bus.error_frames);
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
}

}  // namespace

Daemon::Daemon(std::vector<BusConfig> buses, bool create_buses, const RomOptions& rom,
               const std::optional<RecordRequest>& record)
    : clock_(monotonic_now()),
      timer_(loop_, [this] { serve_all(); }),
      links_(loop_, [this] { follow_links(); }),
      signals_(loop_, SIGINT, SIGTERM),
      patience_(loop_),
      started_(monotonic_now()) {
  check_can_support();
  // Nothing is made or brought up before all that exists has been looked at.
  for (const auto& bus : buses) {
    if (!create_buses || link_state(bus.interface).index != 0) check_interface(bus.interface);
  }
  if (!rom.in_memory) rom_store_.emplace(rom, buses);
  if (record) {
    recorder_.emplace(record->directory, recording_info(*record, SimTime{0}), record->texts, buses);
  }
  for (const auto& bus : buses) {
    if (create_buses) make(bus.interface);
  }
  for (std::size_t i = 0; i < buses.size(); ++i) {
    const auto on_frames = [this, i] {
      const MonoTime mono = monotonic_now();
      serve(i, mono);
      arm_timer(mono);
    };
    lines_.emplace_back(new Line{
        Bus(buses[i]), SocketCanPort(loop_, buses[i].interface, reception_for(buses[i]), on_frames),
        RomGate(buses[i]), print_ids(buses[i].servos)});
  }
}

void Daemon::run() {
  signals_.async_wait([this](const auto& /*error*/, int /*signal*/) { begin_stop(); });
  started_ = monotonic_now();
  clock_ = SimClock(started_);
  follow_links();
  serve_all();
  loop_.run();
  print_summary();
  if (!disk_is_done()) {
    // The writer's thread may stand in a system call for as long as the disk likes. Ending the
    // process is cutting the power, and a file that is not done yet is as it was.
    spdlog::default_logger()->flush();
    std::fflush(nullptr);
    std::_Exit(EXIT_SUCCESS);
  }
}

void Daemon::serve(std::size_t index, MonoTime mono) {
  if (stopping_) return;
  Line& line = *lines_[index];
  const auto [now, slipped] = clock_.read(mono, line.bus.time());
  if (slipped > SimTime{0}) slip_reporter_.slipped(mono, slipped);
  line.port.receive([&, at = now](const ReceivedFrame& received) {
    take_in(index, {at - received.age, received.frame});
  });
  bring_to(index, now);
}

void Daemon::take_in(std::size_t index, TimedFrame in) {
  Bus& bus = lines_[index]->bus;
  in.at = frame_instant(in.at, bus.time());
  if (recorder_) {
    // A replay has to put it on the same bus, in the same state.
    bring_to(index, in.at);
    recorder_->host_frame(index, in.at, in.frame);
  }
  bus.receive(in);
}

void Daemon::bring_to(std::size_t index, SimTime until) {
  Line& line = *lines_[index];
  line.bus.advance_to(until);
  keep_rom(index);
  replies_.clear();
  line.bus.take_replies(replies_);
  leaving_.clear();
  for (const TimedFrame& reply : replies_) {
    if (recorder_) recorder_->reply(index, reply);
    line.gate.pass(reply, leaving_);
  }
  for (const protocol::Frame& frame : leaving_) line.port.send(frame);
}

void Daemon::keep_rom(std::size_t index) {
  Line& line = *lines_[index];
  rom_writes_.clear();
  line.bus.take_rom_writes(rom_writes_);
  for (const RomWrite& write : rom_writes_) {
    line.gate.begin(write);
    if (rom_store_) {
      rom_writer().write(rom_store_->place(index, write.id), write);
    } else {
      settle_rom(index, write, 0);
    }
  }
}

/// Most runs write nothing and get by without a second thread.
RomWriter& Daemon::rom_writer() {
  if (!rom_writer_) {
    rom_writer_.emplace([this](const RomPlace& place, const RomWrite& write, int error) {
      boost::asio::post(loop_,
                        [this, bus = place.bus, write, error] { settle_rom(bus, write, error); });
    });
  }
  return *rom_writer_;
}

void Daemon::settle_rom(std::size_t index, const RomWrite& write, int error) {
  Line& line = *lines_[index];
  if (error != 0) {
    spdlog::error("{}:{}: ROM not written: {}; the drive goes on with RAM", line.port.interface(),
                  write.id, std::generic_category().message(error));
  }
  leaving_.clear();
  if (const auto* kept = line.gate.settle(write, error == 0, leaving_)) {
    line.bus.restore_rom(write.id, kept->rom, kept->wear);
    if (recorder_) {
      recorder_->restored_rom(index, line.bus.time(), write.id, kept->rom, kept->wear);
    }
  }
  for (const protocol::Frame& frame : leaving_) line.port.send(frame);
}

bool Daemon::rom_is_settled() const {
  return std::all_of(lines_.begin(), lines_.end(),
                     [](const auto& line) { return line->gate.idle(); });
}

bool Daemon::disk_is_done() const { return rom_is_settled() && (!recorder_ || recorder_->done()); }

bool Daemon::replies_have_left() const {
  return std::all_of(lines_.begin(), lines_.end(),
                     [](const auto& line) { return line->port.stats().pending == 0; });
}

/// What was written is acknowledged before the power goes, if the disk answers in time; another
/// signal does not wait for that.
void Daemon::begin_stop() {
  stopping_ = true;
  if (recorder_) {
    std::vector<SimTime> times;
    for (const auto& line : lines_) times.push_back(line->bus.time());
    recorder_->end(times);
  }
  signals_.async_wait([this](const auto& /*error*/, int /*signal*/) { loop_.stop(); });
  give_up_disk_ = monotonic_now() + kLongestGoodbye;
  give_up_ = give_up_disk_ + kLongestFlush;
  wait_to_end();
}

void Daemon::wait_to_end() {
  const MonoTime now = monotonic_now();
  const bool disk_is_over = disk_is_done() || now >= give_up_disk_;
  if (disk_is_over) give_up_ = std::min(give_up_, now + kLongestFlush);
  if (disk_is_over && (replies_have_left() || now >= give_up_)) {
    loop_.stop();
    return;
  }
  patience_.expires_after(kGoodbyeStep);
  patience_.async_wait([this](const auto& /*error*/) { wait_to_end(); });
}

void Daemon::serve_all() {
  // One reading for all: a clock costs nothing on most machines, and a system call on some.
  const MonoTime mono = monotonic_now();
  for (std::size_t i = 0; i < lines_.size(); ++i) serve(i, mono);
  slip_reporter_.check(mono);
  arm_timer(mono);
}

void Daemon::follow_links() {
  for (auto& line : lines_) line->port.check_link();
  say_ready_once();
}

void Daemon::say_ready_once() {
  const bool all_up = std::all_of(lines_.begin(), lines_.end(),
                                  [](const auto& line) { return line->port.is_up(); });
  if (ready_ || !all_up) return;
  ready_ = true;
  std::string text = "lk-emu ready";
  for (const auto& line : lines_) text += " " + line->port.interface() + ":" + line->ids;
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

void Daemon::arm_timer(MonoTime mono) {
  MonoTime wake = mono + kLongestSleep;
  for (const auto& line : lines_) {
    if (const auto due = line->bus.next_due()) wake = std::min(wake, clock_.to_mono(*due));
  }
  timer_.wake_by(wake);
}

void Daemon::print_summary() const {
  std::printf("lk-emu stopped after %.1f s\n", in_seconds(monotonic_now() - started_));
  for (const auto& line : lines_) {
    print_bus(line->bus.stats(), line->port.interface() + ":" + line->ids);
    print_gate(line->gate);
    print_port(line->port.stats());
  }
  if (clock_.slips() > 0) {
    std::printf("simulated time slipped %" PRIu64 " times, %.3f s in all\n", clock_.slips(),
                in_seconds(clock_.total_slip()));
  }
  std::fflush(stdout);
}

}  // namespace lk::emulator

#include "tools/campaign/hosts/running_case.hpp"

#include <fcntl.h>
#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp is POSIX
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/campaign/hosts/host_command.hpp"
#include "tools/campaign/hosts/host_verdict.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using What = CaseKeeper::What;

/// A machine with much to do may take long to start a program.
constexpr auto kStartPatience = std::chrono::seconds(60);
/// For an answer of lk-emu; the rest of a long scenario may have to pass before it.
constexpr auto kAnswerPatience = std::chrono::seconds(600);
/// Of what is above it: the path of a terminal in there has to fit into the name of a bus.
constexpr std::size_t kLongestDirectory = 60;
/// A scenario is over when its last instant is; what is rounded may be before.
constexpr double kBeyondEnd_s = 0.001;

}  // namespace

CaseDirectory::CaseDirectory() {
  std::error_code none;
  fs::path above = fs::temp_directory_path(none);
  if (none || above.string().size() > kLongestDirectory) above = "/tmp";
  std::string name = (above / "lk-case-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw StartError(name + ": " + reason_of(errno));
  path_ = name;
}

CaseDirectory::~CaseDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Pipe::Pipe() {
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw StartError("host: " + reason_of(errno));
  from = Descriptor(ends[0]);
  to = Descriptor(ends[1]);
  ::fcntl(from.get(), F_SETFL, O_NONBLOCK);
}

RunningCase::RunningCase(const HostSetup& setup, const HostCase& one, std::string name, int stop)
    : setup_(setup),
      case_(one),
      name_(std::move(name)),
      stop_(stop),
      bus_(setup.bus, directory_.path()),
      output_(setup.detecting_lines),
      control_(directory_.path() / "control") {
  const fs::path control = directory_.path() / "control";
  std::string for_host;
  if (setup.stepped) {
    for_host = (directory_.path() / "host").string();
    relay_.emplace(for_host, control, [this] { take_output(); });
  }
  // The log is asked for when something is wrong; a pipe that nobody reads would stop it.
  const Descriptor log(
      ::open((directory_.path() / "log").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  if (!log) throw StartError(directory_.path().string() + ": " + reason_of(errno));
  Program emulator = emulator_program(setup, one, bus_, control.string());
  emulator.out = said_.to.get();
  emulator.error = log.get();
  Program host = host_program(setup, one, bus_, for_host);
  host.out = host.error = host_said_.to.get();
  keeper_.emplace(emulator, host, directory_.path().string(), bus_.own_network());
  said_.to = Descriptor();
  host_said_.to = Descriptor();
}

bool RunningCase::start_emulator() {
  keeper_->start_emulator();
  const WallTime deadline = Clock::now() + kStartPatience;
  while (!ready_) {
    if (!wait(deadline)) {
      if (stopped_) return false;
      fail("lk-emu was not ready within " + std::to_string(kStartPatience.count()) + " s");
    }
  }
  return true;
}

std::optional<HostRun> RunningCase::run_host() {
  HostRun run;
  begin_scenario(case_.scenario_toml);
  const auto began = Clock::now();
  keeper_->start_host();
  run.started_at = now();
  if (!wait_for_host(run)) return std::nullopt;
  run.wall_s = std::chrono::duration<double>(Clock::now() - began).count();
  take_output();
  run.ended_at = now();
  end_others();
  take_output();
  output_.finish([&] { return run.ended_at; });
  run.notices = output_.notices();
  const bool tells = run.end == HostRun::End::kExit &&
                     std::ranges::count(setup_.detecting_exit_status, run.status) > 0;
  if (tells) {
    const std::string text = "exit status " + std::to_string(run.status);
    run.notices.push_back({run.ended_at, text, 0, text});
  }
  run.output = output_.tail();
  finish_scenario(run);
  return run;
}

/// Waits for whatever comes next, and takes it. Returns false when nothing came in time, or when it
/// is to stop.
bool RunningCase::wait(WallTime deadline) {
  waits_.clear();
  waits_.push_back({stop_, POLLIN, 0});
  waits_.push_back({keeper_->descriptor(), POLLIN, 0});
  waits_.push_back({ready_ ? -1 : said_.from.get(), POLLIN, 0});
  waits_.push_back({host_silent_ ? -1 : host_said_.from.get(), POLLIN, 0});
  if (relay_) relay_->add_to(waits_);
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  if (left.count() <= 0) return false;
  const auto patience = std::min<std::int64_t>(left.count(), 1'000'000);
  if (::poll(waits_.data(), waits_.size(), static_cast<int>(patience)) < 0) return errno == EINTR;
  stopped_ = waits_[0].revents != 0;
  if (stopped_) return false;
  if (waits_[2].revents != 0) {
    std::array<char, 512> text;
    const ssize_t size = ::read(said_.from.get(), text.data(), text.size());
    if (size > 0) ready_text_.append(text.data(), static_cast<std::size_t>(size));
    ready_ = ready_text_.find("lk-emu ready ") != std::string::npos;
  }
  if (waits_[3].revents != 0) take_output();
  // Its requests before its end.
  if (relay_) relay_->serve(waits_.data() + 4);
  if (waits_[1].revents != 0) take_events();
  return true;
}

void RunningCase::take_events() {
  while (const auto event = keeper_->take()) {
    switch (event->what) {
      case What::kEmulatorEnded:
        fail(last_words(ready_ ? "lk-emu ended" : "lk-emu did not start"));
      case What::kEmulatorAbsent:
        fail("lk-emu cannot be started: " + reason_of(event->value));
      case What::kHostAbsent:
        throw StartError("host: command: " + setup_.command.front() +
                         " cannot be started: " + reason_of(event->value));
      case What::kNoNetwork:
        fail("no network of its own is to be had: " + reason_of(event->value));
      case What::kHostEnded:
        host_ended_ = event->value;
        break;
      case What::kOthersEnded:
        others_ended_ = true;
        break;
    }
  }
}

void RunningCase::take_output() {
  if (host_silent_) return;
  host_silent_ = !output_.take(host_said_.from.get(), [this] { return now(); });
}

void RunningCase::begin_scenario(const std::string& toml) {
  const fs::path file = directory_.path() / ("case-" + std::to_string(case_.number) + ".toml");
  std::ofstream(file, std::ios::binary) << toml;
  ask("POST", "/scenario", Json{{"file", file.string()}});
  started_s_ = ask("GET", "/scenario").at("buses").at(0).at("started_s").get<double>();
}

/// Returns false when it is to stop.
bool RunningCase::wait_for_host(HostRun& run) {
  const auto limit = std::chrono::duration<double>(setup_.timeout_s);
  const WallTime deadline = Clock::now() + std::chrono::ceil<std::chrono::milliseconds>(limit);
  while (!host_ended_) {
    if (wait(deadline)) continue;
    if (stopped_) return false;
    run.end = HostRun::End::kTimeout;
    return true;
  }
  run.end = WIFSIGNALED(*host_ended_) ? HostRun::End::kSignal : HostRun::End::kExit;
  run.status = WIFSIGNALED(*host_ended_) ? WTERMSIG(*host_ended_) : WEXITSTATUS(*host_ended_);
  return true;
}

void RunningCase::end_others() {
  keeper_->end_others();
  const WallTime deadline = Clock::now() + kAnswerPatience;
  while (!others_ended_) {
    if (!wait(deadline) && !stopped_) fail("what the host has started cannot be ended");
    if (stopped_) stop_ = -1;  // it is at its end anyway
  }
}

/// Nobody waits for it any more: as fast as it goes.
void RunningCase::finish_scenario(HostRun& run) {
  run.slipped_s = ask("GET", "/clock").at("slipped_s").get<double>();
  if (!setup_.stepped) ask("PUT", "/clock", Json{{"mode", "stepped"}});
  const Json state = ask("GET", "/scenario");
  if (state.at("state") == "running") {
    const double end_s = started_s_ + state.at("duration_s").get<double>() + kBeyondEnd_s;
    ask("POST", "/clock/advance", Json{{"to_s", end_s}});
  }
  try {
    run.verdict = host_verdict(ask("DELETE", "/scenario"), setup_.bus);
  } catch (const Json::exception& problem) {
    fail(std::string("lk-emu gives no verdict: ") + problem.what());
  }
}

SimTime RunningCase::now() const {
  const double clock_s = ask("GET", "/clock").at("time_s").get<double>();
  return SimTime(std::llround((clock_s - started_s_) * 1e6) * 1000);  // it shows microseconds
}

Json RunningCase::ask(const char* method, const std::string& path, const Json& body) const {
  CtlClient::Answer answer;
  try {
    answer = control_.ask(method, path, body, kAnswerPatience);
  } catch (const StartError&) {
    fail(last_words("lk-emu does not answer"));
  }
  if (answer.status >= 200 && answer.status < 300) return answer.body;
  const Json error = answer.body.value("error", Json::object());
  fail(error.value("where", "") + ": " + error.value("reason", "refused"));
}

void RunningCase::fail(const std::string& why) const { throw StartError(name_ + ": " + why); }

/// The last line of the log behind `what`; where that says why there was no start, it alone.
std::string RunningCase::last_words(const std::string& what) const {
  std::ifstream log(directory_.path() / "log");
  std::string line, last;
  while (std::getline(log, line)) {
    if (!line.empty()) last = on_one_line(line);
  }
  constexpr std::string_view kName = "lk-emu: ";
  if (last.starts_with(kName)) return last.substr(kName.size());
  return last.empty() ? what : what + ": " + last;
}

}  // namespace lk::emulator

#include "emulator/io/shafts/shaft_server.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <thread>
#include <utility>

#include "emulator/core/overloaded.hpp"
#include "emulator/core/start_error.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

using boost::system::error_code;

/// Time-out from the connection to the first STATES; a simulator may load its model meanwhile.
constexpr auto kFirstStatesTimeout = std::chrono::seconds(10);
constexpr SimTime kShortestStep = std::chrono::microseconds(50);  // the same limit as in [body]
constexpr SimTime kLongestStep = std::chrono::milliseconds(10);
/// Time of busy polling after TORQUES or STATES: waking from sleep takes as long as an exchange.
constexpr auto kPolling = std::chrono::microseconds(100);
constexpr const char* kClockIsHeld = "the simulator at --shafts owns the clock";

}  // namespace

ShaftServer::ShaftServer(boost::asio::io_context& loop, World& world, const ShaftOptions& options)
    : loop_(loop),
      world_(world),
      lost_(options.lost),
      first_states_timer_(loop),
      step_timer_(loop, [this] { on_step_timeout(); }) {
  for (std::size_t n = 0; n < world.lines().size(); ++n) {
    const Line& line = *world.lines()[n];
    for (const ServoConfig& servo : line.config().servos) {
      if (servo.joint)
        throw StartError("--shafts: not possible with a [body], which moves the shafts itself");
      shafts_.push_back({n, servo.id, line.name() + ":" + std::to_string(servo.id), &servo});
    }
  }
  try {
    listen(options);
  } catch (const StartError& problem) {
    throw StartError("--shafts: " + std::string(problem.what()));
  }
  world_.on_body_step = [this] { return end_step(); };
  spdlog::info("shafts: {} waits for a simulator", place_);
}

void ShaftServer::start() {
  if (lost_ != ShaftsLost::kStop || world_.clock().mode().stepped) return;
  clock_before_ = world_.clock().mode();
  clock_is_stopped_ = true;
  world_.set_clock({.stepped = true});
  spdlog::info("shafts: time is stopped until a simulator connects");
}

ShaftServer::~ShaftServer() { world_.on_body_step = nullptr; }

void ShaftServer::listen(const ShaftOptions& options) {
  const auto on_connect = [this](SocketListener::Socket socket) {
    accept_simulator(socket.release());
  };
  if (!options.path.empty()) {
    place_ = "unix:" + options.path;
    listener_.emplace(loop_, std::filesystem::path(options.path), on_connect);
    return;
  }
  error_code error;
  const auto address = boost::asio::ip::make_address(options.address, error);
  if (error) throw StartError("\"" + options.address + "\" is not an IP address");
  listener_.emplace(loop_, address, options.port, on_connect);
  const std::string host = url_host(address);
  place_ = "tcp:" + host + ":" + std::to_string(listener_->port());
  if (!address.is_loopback()) {
    spdlog::warn("--shafts: anyone who can reach {} can turn these shafts and stop the time{}",
                 host, address.is_unspecified() ? "; that is all addresses of this machine" : "");
  }
}

bool ShaftServer::is_stiff(const Shaft& shaft) const {
  return is_one_shaft(shaft.servo->profile.drive.mechanics, step_);
}

/// Returns the shaft's state for its joint. With a stiff gear, the armature includes the rotor.
model::MountedShaft ShaftServer::now(const Shaft& shaft) const {
  model::MountedShaft is = world_.lines()[shaft.bus]->bus_on_body().state().mounted_shaft(shaft.id);
  const model::MechanicsParams& m = shaft.servo->profile.drive.mechanics;
  if (is_stiff(shaft)) is.armature = m.J_out + m.J * m.gear_ratio * m.gear_ratio;
  return is;
}

void ShaftServer::accept_simulator(int fd) {
  if (simulator_ || world_.stopped()) {
    const ShaftBytes end = end_message("another simulator is connected");
    ::send(fd, end.data(), end.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    ::close(fd);
    if (!std::exchange(refused_, true)) {
      spdlog::warn("shafts: a second simulator was refused: one is connected");
    }
    return;
  }
  simulator_.emplace(loop_, fd, static_cast<std::uint32_t>(shafts_.size()), ++simulators_);
  simulator_->may_log = log_limit_.may_log("shafts");
  world_.serve_all();  // advances the shafts to the present
  std::vector<lk_shafts_offer> offers;
  for (const Shaft& shaft : shafts_) {
    const model::MountedShaft is = now(shaft);
    lk_shafts_offer offer{};
    offer.armature_kg_m2 = is.armature;
    offer.angle_rad = is.theta;
    shaft.name.copy(offer.name, LK_SHAFTS_NAME_BYTES - 1);
    offers.push_back(offer);
  }
  send(offer_message(offers, static_cast<std::uint64_t>(step_.count())));
  first_states_timer_.expires_after(kFirstStatesTimeout);
  first_states_timer_.async_wait([this, mine = simulators_](const error_code& aborted) {
    const bool silent = simulator_ && simulator_->number == mine && simulator_->body == nullptr;
    if (!aborted && silent) disconnect("sent nothing for 10 s", true);
  });
  wait_readable();
}

void ShaftServer::wait_readable() {
  simulator_->socket.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                                [this, mine = simulator_->number](const error_code& error) {
                                  if (!error && is_here(mine)) read_all();
                                });
}

/// Reads all received bytes, then waits for more; until `poll_until_` it polls instead, if the
/// simulator owns the time.
void ShaftServer::read_all() {
  const unsigned mine = simulator_->number;
  while (read_some()) {
  }
  if (!is_here(mine)) return;
  if (!owns_time() || monotonic_now() >= poll_until_) return wait_readable();
  boost::asio::post(loop_, [this, mine] {
    if (!is_here(mine)) return;
    std::this_thread::yield();  // lets the simulator run on a single processor
    read_all();
  });
}

bool ShaftServer::read_some() {
  std::array<unsigned char, 4096> bytes;
  const ssize_t size =
      ::recv(simulator_->socket.native_handle(), bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return false;
  if (size <= 0) {
    size == 0 ? on_closed() : disconnect("has gone: " + errno_text(errno), false);
    return false;
  }
  std::span<const unsigned char> left(bytes.data(), static_cast<std::size_t>(size));
  while (!left.empty() && simulator_) {
    const std::size_t some = std::min(left.size(), simulator_->reader.bytes_missing());
    on_message(simulator_->reader.take(left.first(some)));
    left = left.subspan(some);
  }
  return simulator_ && static_cast<std::size_t>(size) == bytes.size();
}

void ShaftServer::on_message(ShaftReader::Message message) {
  std::visit(overloaded{[](ShaftReader::More) {},
                        [this](ShaftAccept& accept) { on_accept(std::move(accept)); },
                        [this](const ShaftStates& states) { on_states(states); },
                        [this](const std::string& wrong) { disconnect(wrong, true); }},
             message);
}

void ShaftServer::on_accept(ShaftAccept accept) {
  if (simulator_->accepted) return disconnect("sent a second ACCEPT", true);
  const std::uint32_t time = accept.head.what;
  if (time != LK_SHAFTS_TIME_IS_SIMULATORS && time != LK_SHAFTS_TIME_IS_DRIVES) {
    return disconnect(fmt::format("sent the time owner {}; allowed: 1 and 2", time), true);
  }
  const std::uint64_t asked_ns = accept.head.number;
  const SimTime step = asked_ns == 0 ? step_ : SimTime(static_cast<std::int64_t>(asked_ns));
  if (step < kShortestStep || step > kLongestStep) {
    return disconnect(fmt::format("asked for steps of {} ns; allowed: 50000 to 10000000", asked_ns),
                      true);
  }
  for (std::size_t n = 0; n < shafts_.size(); ++n) {
    const lk_shafts_accept& terms = accept.records[n];
    const Shaft& shaft = shafts_[n];
    if (terms.owner > LK_SHAFTS_DRIVE || terms.flags > LK_SHAFTS_TORQUE_UNTOLD) {
      return disconnect(
          fmt::format("sent owner {} and flags {} for {}", terms.owner, terms.flags, shaft.name),
          true);
    }
    if (terms.owner == LK_SHAFTS_NOT_COUPLED) continue;
    const auto f_Hz = protocol::rounded(shaft.servo->profile.drive.inverter.f_pwm);
    if (f_Hz * step.count() % 1'000'000'000 != 0) {
      return disconnect(
          fmt::format("asked for steps of {} ns, not a multiple of the PWM period of {}",
                      step.count(), shaft.name),
          true);
    }
    simulator_->taken.push_back(n);
  }
  if (simulator_->taken.empty()) return disconnect("accepted none of the shafts", true);
  step_ = step;
  simulator_->accepted = std::move(accept);
}

void ShaftServer::on_states(const ShaftStates& states) {
  if (world_.stopped()) return;
  if (!simulator_->accepted) return disconnect("sent STATES before ACCEPT", true);
  if (!simulator_->states_pending) return disconnect("sent STATES out of turn", true);
  if (states.head.number != simulator_->answers) {
    return disconnect(
        fmt::format("sent STATES {}, expected {}", states.head.number, simulator_->answers), true);
  }
  if (simulator_->body == nullptr) return begin(states);
  std::vector<lk_shafts_state> taken;
  for (const std::size_t n : simulator_->taken) taken.push_back(states.records[n]);
  if (const auto problem = simulator_->body->problem_of(taken)) {
    return disconnect("sent nonsense: " + *problem, true);
  }
  simulator_->states_pending = false;
  poll_until_ = monotonic_now() + kPolling;
  // If the numbers differ, STATES came late: the drives have continued, and ignore them.
  if (simulator_->answers != simulator_->steps_done) return;
  simulator_->body->take(taken);
  world_.body_is_ready();
  if (owns_time()) step_clock();
}

/// Advances the clock by one step; later, if the previous advance still waits to send replies.
void ShaftServer::step_clock() {
  if (world_.advancing()) {
    step_is_due_ = true;
    return;
  }
  const bool between = !world_.coupling()->under_way();
  world_.advance(world_.coupling()->next_due() + (between ? step_ : SimTime{0}),
                 [this](World::Advanced /*how*/) {
                   if (std::exchange(step_is_due_, false) && owns_time() && world_.coupling()) {
                     step_clock();
                   }
                 });
}

/// Handles the first states: couples the drives to the joints.
void ShaftServer::begin(const ShaftStates& states) {
  std::vector<ShaftJoint> joints;
  std::vector<CoupledDrive> drives;
  std::vector<lk_shafts_state> taken;
  for (const std::size_t n : simulator_->taken) {
    const Shaft& shaft = shafts_[n];
    const model::MountedShaft is = now(shaft);
    drives.push_back({shaft.bus, shaft.id, {.joint = joints.size()}, is_stiff(shaft)});
    joints.push_back(
        {shaft.name, simulator_->accepted->records[n], is.theta, is.omega, is.armature});
    taken.push_back(states.records[n]);
  }
  auto body = std::make_unique<ShaftBody>(std::move(joints), step_);
  if (const auto problem = body->problem_of(taken)) {
    return disconnect("sent nonsense: " + *problem, true);
  }
  body->take(taken);
  simulator_->body = body.get();
  simulator_->states_pending = false;
  first_states_timer_.cancel();
  take_clock();
  if (simulator_->may_log) {
    spdlog::info("shafts: a simulator has {} of {} joints, {} time, in steps of {:g} ms",
                 simulator_->taken.size(), shafts_.size(), owns_time() ? "its own" : "the drives'",
                 static_cast<double>(step_.count()) * 1e-6);
  }
  world_.couple(std::move(body), drives);
  owns_time() ? step_clock() : world_.serve_all();
}

void ShaftServer::take_clock() {
  const bool stepped = world_.clock().mode().stepped;
  const bool stopped_by_us = std::exchange(clock_is_stopped_, false) && stepped;
  if (!stopped_by_us) clock_before_ = world_.clock().mode();
  if (owns_time()) {
    if (!stepped) world_.set_clock({.stepped = true});
    world_.clock_owner = kClockIsHeld;
  } else if (stopped_by_us) {
    world_.set_clock(clock_before_);
  }
}

bool ShaftServer::end_step() {
  if (!simulator_) return true;
  ++simulator_->steps_done;
  // A late simulator gets the mean of these steps after its STATES.
  if (simulator_->states_pending) return true;
  simulator_->answers = simulator_->steps_done;
  simulator_->states_pending = true;
  send_torques();
  const ClockMode& clock = world_.clock().mode();
  if (!clock.stepped) {
    const MonoTime now = monotonic_now();
    step_deadline_ =
        now + MonoTime(protocol::rounded(static_cast<double>(step_.count()) / clock.factor));
    step_timer_.wake_by(step_deadline_, now);
  }
  return false;
}

void ShaftServer::send_torques() {
  const std::vector<lk_shafts_torque> given = simulator_->body->torques();
  std::vector<lk_shafts_torque> all(shafts_.size());
  for (std::size_t n = 0; n < given.size(); ++n) all[simulator_->taken[n]] = given[n];
  send(torques_message(all, simulator_->body->steps(), simulator_->steps_done));
  poll_until_ = monotonic_now() + kPolling;
}

void ShaftServer::on_step_timeout() {
  const bool waits = simulator_ && simulator_->body != nullptr && simulator_->states_pending &&
                     simulator_->answers == simulator_->steps_done;
  if (!waits) return;
  const MonoTime now = monotonic_now();
  if (now < step_deadline_) return step_timer_.wake_by(step_deadline_, now);
  if (!std::exchange(simulator_->late, true) && simulator_->may_log) {
    spdlog::warn("shafts: the simulator is late: its last message is extrapolated");
  }
  world_.body_is_ready();
}

/// Shuts the connection down if not all bytes fit: the simulator does not read. The next read then
/// reports the end of the connection (`on_closed`).
void ShaftServer::send(const ShaftBytes& bytes) {
  const int fd = simulator_->socket.native_handle();
  const ssize_t size = ::send(fd, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (size == static_cast<ssize_t>(bytes.size())) return;
  if (size >= 0 || errno == EAGAIN) simulator_->is_not_reading = true;
  ::shutdown(fd, SHUT_RDWR);
}

/// The simulator has closed the connection, or `send` has because the simulator does not read.
void ShaftServer::on_closed() {
  if (simulator_->is_not_reading) return disconnect("", false);
  release(lost_ == ShaftsLost::kFree ? spdlog::level::info : spdlog::level::warn, "has gone");
}

void ShaftServer::disconnect(const std::string& why, bool at_fault) {
  if (at_fault) send(end_message(why));
  release(spdlog::level::err, simulator_->is_not_reading ? "does not read" : why);
}

void ShaftServer::release(spdlog::level::level_enum level, const std::string& why) {
  const bool coupled = simulator_->body != nullptr;
  const char* const next = lost_ == ShaftsLost::kFree ? ": the drives keep running without it"
                                                      : ": time is stopped until one connects";
  if (simulator_->may_log) {
    spdlog::log(level, "shafts: the simulator {}{}", why, coupled ? next : "");
  }
  if (coupled) uncouple_drives();
  simulator_.reset();
}

void ShaftServer::uncouple_drives() {
  std::vector<model::LoadParams> loads;
  for (std::size_t n = 0; n < simulator_->taken.size(); ++n) {
    const Shaft& shaft = shafts_[simulator_->taken[n]];
    const double inertia = simulator_->body->joint(n).inertia_kg_m2 - now(shaft).armature;
    loads.push_back({.J = std::max(inertia, 0.0)});
  }
  const bool had_time = owns_time();
  step_is_due_ = false;
  world_.uncouple();
  world_.clock_owner.clear();
  world_.end_advance();
  for (std::size_t n = 0; n < loads.size(); ++n) {
    const Shaft& shaft = shafts_[simulator_->taken[n]];
    world_.lines()[shaft.bus]->bus_on_body().set_load(shaft.id, loads[n]);
  }
  if (lost_ == ShaftsLost::kStop) {
    clock_is_stopped_ = had_time || !world_.clock().mode().stepped;
    if (!world_.clock().mode().stepped) world_.set_clock({.stepped = true});
  } else if (had_time && !clock_before_.stepped) {
    world_.set_clock(clock_before_);
  }
}

}  // namespace lk::emulator

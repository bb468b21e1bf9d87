#include "emulator/core/faults/fault_board.hpp"

#include <algorithm>
#include <cassert>
#include <set>
#include <string_view>
#include <utility>

#include "emulator/core/faults/acts.hpp"
#include "emulator/core/frame_text.hpp"

namespace lk::emulator {

using State = FaultEvidence::State;

void LiveFault::took_effect(SimTime now, int id, const protocol::Frame* frame) {
  if (evidence.effects++ > 0) return;
  evidence.first_effect_at = now;
  if (id != kWholeBus) evidence.first_on = "drive " + std::to_string(id);
  if (id == kWholeBus && frame == nullptr) evidence.first_on = "bus";
  if (frame != nullptr) {
    evidence.first_on += (evidence.first_on.empty() ? "" : ", ") + frame_text(*frame);
  }
}

std::vector<FaultReport> FaultBoard::reports() const {
  std::vector<FaultReport> reports;
  reports.reserve(faults_.size());
  for (const LiveFault& live : faults_) {
    reports.push_back({live.fault, live.evidence, live.order});
  }
  return reports;
}

std::size_t FaultBoard::unfinished() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(faults_, [](const LiveFault& live) { return !live.is_over(); }));
}

std::optional<std::size_t> FaultBoard::index_of(std::size_t order) const {
  const auto found = std::ranges::lower_bound(faults_, order, {}, &LiveFault::order);
  if (found == faults_.end() || found->order != order) return std::nullopt;
  return static_cast<std::size_t>(found - faults_.begin());
}

std::optional<std::size_t> FaultBoard::oldest_over() const {
  const auto oldest = std::ranges::find_if(faults_, &LiveFault::is_over);
  if (oldest == faults_.end()) return std::nullopt;
  return static_cast<std::size_t>(oldest - faults_.begin());
}

std::string FaultBoard::free_name(const Fault& fault) const {
  const std::string wanted = fault.name.empty() ? std::string(fault.row->word) : fault.name;
  std::string name = wanted;
  std::set<std::string_view> taken;
  for (const LiveFault& live : faults_) taken.insert(live.fault.name);
  for (int n = 2; taken.contains(name); ++n) name = wanted + "-" + std::to_string(n);
  return name;
}

std::size_t FaultBoard::arm(Fault fault, SimTime now) {
  assert(!full() && fault.row != nullptr);
  assert(!fault.every || *fault.every > fault.duration.value_or(SimTime{0}));
  fault.name = free_name(fault);
  any_of_adapter_ = any_of_adapter_ || fault.row->adapter != nullptr;
  LiveFault live;
  live.fault = std::move(fault);
  live.evidence.armed_at = now;
  live.anchors.resize(live.fault.ids.size());
  live.order = armed_++;
  live.random = stream_seed(bus_seed_, static_cast<int>(live.order), SeedStream::kFault);
  if (faults_.size() >= kMax) {
    const std::size_t dropped = *oldest_over();
    faults_.erase(faults_.begin() + static_cast<std::ptrdiff_t>(dropped));
    if (turn_ > dropped) --turn_;
  }
  faults_.push_back(std::move(live));
  return faults_.back().order;
}

bool FaultBoard::start(std::size_t order, SimTime now) {
  const auto at = index_of(order);
  if (!at || faults_[*at].evidence.state == State::kCleared) return false;
  LiveFault& live = faults_[*at];
  ++live.beginnings;
  live.since = now;
  live.destroyed = 0;
  live.evidence.began_at = live.evidence.began_at.value_or(now);
  if (live.row().momentary()) {
    live.evidence.state = live.will_recur() ? State::kPaused : State::kOver;
  } else {
    live.evidence.state = State::kActive;
    ++active_;
  }
  return true;
}

void FaultBoard::stop(std::size_t order) {
  LiveFault& live = (*this)[order];
  live.evidence.state = live.will_recur() ? State::kPaused : State::kOver;
  --active_;
}

std::vector<std::size_t> FaultBoard::find(const std::string& which) const {
  std::vector<std::size_t> found;
  for (const LiveFault& live : faults_) {
    const bool meant = which == "all" || which == live.fault.name || which == live.row().word;
    if (meant && !live.is_over()) found.push_back(live.order);
  }
  return found;
}

bool FaultBoard::mark_sampled(std::size_t order, SimTime now) {
  return mark_sampled((*this)[order], now);
}

bool FaultBoard::mark_sampled(LiveFault& live, SimTime now) {
  if (!live.active() || live.row().plant == nullptr || live.sampled_at == now) return false;
  live.sampled_at = now;
  return true;
}

std::vector<std::size_t> FaultBoard::take_due_samples(SimTime now) {
  std::vector<std::size_t> due;
  for (LiveFault& live : faults_) {
    if (live.sampled_at < live.since && mark_sampled(live, now)) due.push_back(live.order);
  }
  std::size_t samples = 0;
  for (std::size_t n = 0; n < faults_.size() && samples < kMaxSamples; ++n) {
    if (LiveFault& live = faults_[turn_]; mark_sampled(live, now)) {
      due.push_back(live.order);
      samples += live.fault.ids.size();
    }
    turn_ = (turn_ + 1) % faults_.size();
  }
  if (samples < kMaxSamples) turn_ = 0;
  return due;
}

LiveFault* FaultBoard::first(int id, bool FaultRow::*trait) {
  LiveFault* first = nullptr;
  each_active(*this, trait, id, [&](LiveFault& live) { first = first ? first : &live; });
  return first;
}

bool FaultBoard::any(bool FaultRow::*trait) const {
  bool any = false;
  each_active(*this, trait, kWholeBus, [&](const LiveFault&) { any = true; });
  return any;
}

model::Faults plant_faults(const FaultBoard& faults, const ServoConfig& servo, SimTime now) {
  model::Faults sum;
  each_active(faults, &FaultRow::plant, servo.id, [&](const LiveFault& live) {
    live.row().plant({live, servo, now - live.since}, sum);
  });
  return sum;
}

FirmwareFaults firmware_faults(const FaultBoard& faults, int id) {
  FirmwareFaults sum;
  each_active(faults, &FaultRow::firmware, id, [&](const LiveFault& live) {
    sum.*live.row().firmware = true;
    if (live.row().firmware_detail != nullptr) live.row().firmware_detail(live, sum);
  });
  return sum;
}

AdapterTimes adapter_times(const FaultBoard& faults, AdapterTimes sum) {
  each_active(faults, &FaultRow::adapter, kWholeBus,
              [&](const LiveFault& live) { live.row().adapter(live, sum); });
  return sum;
}

void count_adapter(FaultBoard& faults, const AdapterEffects& shown, const protocol::Frame& frame,
                   SimTime now) {
  each_active(faults, &FaultRow::adapter_shows, kWholeBus, [&](LiveFault& live) {
    if (shown.*live.row().adapter_shows) live.took_effect(now, kWholeBus, &frame);
  });
}

void count_firmware_effects(FaultBoard& faults, Servo& servo, SimTime now) {
  if (!faults.any_active()) return;
  const FirmwareFaults shown = take_effective_faults(servo);
  each_active(faults, &FaultRow::firmware, servo.id(), [&](LiveFault& live) {
    if (shown.*live.row().firmware) live.took_effect(now, servo.id());
  });
}

bool apply_to_query(FaultBoard& faults, const DriveLink& link, const Servo& servo,
                    protocol::Frame& frame, SimTime now) {
  if (link.bus_off) return false;
  auto fate = OnQuery::Fate::kDelivered;
  each_active(faults, &FaultRow::on_query, servo.id(), [&](LiveFault& live) {
    if (fate == OnQuery::Fate::kLost) return;
    OnQuery on{live, servo, now, frame, fate};
    live.row().on_query(on);
    fate = on.fate;
  });
  return fate == OnQuery::Fate::kDelivered;
}

void count_ignored(FaultBoard& faults, int id, const protocol::Frame& query, SimTime now) {
  if (LiveFault* const full = faults.first(id, &FaultRow::blocks))
    full->took_effect(now, id, &query);
}

FaultedReply apply_to_reply(FaultBoard& faults, int id, const DriveLink& link,
                            const Outgoing& reply, std::int64_t bitrate, SimTime now) {
  FaultedReply faulted{.out = {reply}};
  each_active(faults, &FaultRow::on_reply, id, [&](LiveFault& live) {
    OnReply on{live, id, now, link, faulted.out, bitrate};
    live.row().on_reply(on);
    faulted.lost += on.lost;
    faulted.extra += on.extra;
    faulted.stale = faulted.stale || on.stale;
  });
  return faulted;
}

LiveFault* destroyer(FaultBoard& faults, int sender, std::int64_t bitrate, bool serial) {
  LiveFault* found = nullptr;
  each_active(faults, &FaultRow::destroys, kWholeBus, [&](LiveFault& live) {
    OnWire on{live, sender, bitrate, serial};
    if (found == nullptr && live.row().destroys(on)) found = &live;
  });
  return found;
}

HostCut host_cut(const FaultBoard& faults) {
  HostCut worst = HostCut::kNone;
  each_active(faults, &FaultRow::cut, kWholeBus,
              [&](const LiveFault& live) { worst = std::max(worst, live.row().cut(live)); });
  return worst;
}

void apply_to_read(FaultBoard& faults, protocol::Frame& frame, SimTime now) {
  each_active(faults, &FaultRow::on_read, kWholeBus, [&](LiveFault& live) {
    OnRead on{live, now, frame};
    live.row().on_read(on);
  });
}

LiveFault* line_holder(FaultBoard& faults) {
  LiveFault* longest = nullptr;
  const auto hold_time = [](const LiveFault& live) { return live.row().line_hold_time(live); };
  each_active(faults, &FaultRow::line_hold_time, kWholeBus, [&](LiveFault& live) {
    if (longest == nullptr || hold_time(live) > hold_time(*longest)) longest = &live;
  });
  return longest;
}

SimTime recovery(const FaultBoard& faults, int id) {
  std::optional<SimTime> first;
  each_active(faults, &FaultRow::recovery, id,
              [&](const LiveFault& live) { first = first.value_or(live.row().recovery(live)); });
  return first.value_or(SimTime{0});
}

model::Faults plant_faults(const LiveFault& live, const ServoConfig& servo, SimTime now) {
  model::Faults alone;
  live.row().plant({live, servo, now - live.since}, alone);
  return alone;
}

}  // namespace lk::emulator

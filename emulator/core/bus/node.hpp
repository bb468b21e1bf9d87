#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "emulator/core/bus/link.hpp"
#include "emulator/core/bus/memory.hpp"
#include "emulator/core/bus/motors.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/servo/unasked.hpp"

namespace lk::emulator {

/// A drive on a bus: firmware, location of the motor, supply, flash and link.
struct Node {
  Servo servo;
  MotorLocation motor;
  Power power;
  Memory memory;
  DriveLink link;
  SimTime started{0};  // last start of the controller
  JointState joint{};
  Unasked unasked{};
  int flags_left = 0;  // error flags still to send, because the drive is at another bit rate

  int id() const { return servo.id(); }
};

/// Drives of a bus, ascending by configured ID, which is unique. Several drives may answer at the
/// same address.
class Nodes {
 public:
  Nodes() {
    index_of_id_.fill(-1);
    at_address_.fill(0);
  }
  /// Throws std::invalid_argument unless the ID is in 1..32 and above all present ones.
  void add(Node node) {
    if (node.id() < protocol::kMinId || node.id() > protocol::kMaxId) {
      throw std::invalid_argument("drive " + std::to_string(node.id()) + ": IDs are 1 to 32");
    }
    if (!nodes_.empty() && node.id() <= nodes_.back().id()) {
      throw std::invalid_argument("drive " + std::to_string(node.id()) + " follows drive " +
                                  std::to_string(nodes_.back().id()) +
                                  ": the IDs of a bus must ascend, each once");
    }
    index_of_id_[static_cast<std::size_t>(node.id())] = static_cast<std::int8_t>(nodes_.size());
    nodes_.push_back(std::move(node));
    update_addresses();
  }
  /// Updates the address table. Call after a change of a drive's address, bus or bit rate.
  void update_addresses() {
    const auto before = at_address_;
    at_address_.fill(0);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      const Servo& servo = nodes_[n].servo;
      if (!servo.on_its_bus() || !servo.at_its_rate()) continue;
      at_address_[static_cast<std::size_t>(servo.address())] |= 1U << n;
    }
    if (at_address_ != before) ++address_changes_;
  }
  /// Number of changes of the address table.
  std::uint64_t address_changes() const { return address_changes_; }
  /// Drives that receive frames for the address `id`, as bits for `each`; 0: no drive.
  std::uint32_t at_address(int id) const {
    return id >= protocol::kMinId && id <= protocol::kMaxId
               ? at_address_[static_cast<std::size_t>(id)]
               : 0;
  }
  /// Calls `act` for each drive in `bits`.
  template <class Act>
  void each(std::uint32_t bits, Act act) {
    for (; bits != 0; bits &= bits - 1) {
      act(nodes_[static_cast<std::size_t>(std::countr_zero(bits))]);
    }
  }
  /// Calls `act` for each drive that receives frames, in the order of present addresses.
  template <class Act>
  void each_by_address(Act act) {
    for (const std::uint32_t bits : std::array(at_address_)) each(bits, act);
  }
  bool has(int id) const {
    return id >= protocol::kMinId && id <= protocol::kMaxId &&
           index_of_id_[static_cast<std::size_t>(id)] >= 0;
  }
  // Throws std::out_of_range if the drive `id` is not on the bus.
  Node& of(int id) { return nodes_[index_of(id)]; }
  const Node& of(int id) const { return nodes_[index_of(id)]; }
  std::size_t size() const { return nodes_.size(); }
  auto begin() { return nodes_.begin(); }
  auto end() { return nodes_.end(); }
  auto begin() const { return nodes_.begin(); }
  auto end() const { return nodes_.end(); }

 private:
  std::size_t index_of(int id) const {
    if (!has(id)) throw std::out_of_range("drive " + std::to_string(id) + ": not on this bus");
    return static_cast<std::size_t>(index_of_id_[static_cast<std::size_t>(id)]);
  }
  std::vector<Node> nodes_;
  std::array<std::int8_t, protocol::kMaxId + 1> index_of_id_{};   // −1 = not on the bus
  std::array<std::uint32_t, protocol::kMaxId + 1> at_address_{};  // bit n: drive nodes_[n]
  std::uint64_t address_changes_ = 0;
};

}  // namespace lk::emulator

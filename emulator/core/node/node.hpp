#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "emulator/core/node/link.hpp"
#include "emulator/core/node/memory.hpp"
#include "emulator/core/node/motors.hpp"
#include "emulator/core/node/power.hpp"
#include "emulator/core/servo/servo.hpp"

namespace lk::emulator {

/// A drive on a bus: what answers, where its motor is computed, and what happens to it over time
/// besides answering.
struct Node {
  Servo servo;
  MotorPlace motor;
  Power power;
  Memory memory;
  DriveLink link;
  SimTime started{0};  // its controller, last
  JointState joint{};
  int flags_left = 0;  // error flags that it sends yet because it is at another bit rate

  int id() const { return servo.id(); }
};

/// The drives of a bus, by ID, ascending. The configured ID is all that tells one from the other;
/// what a drive answers at is its address, which several may share.
class Nodes {
 public:
  Nodes() {
    index_of_id_.fill(-1);
    at_address_.fill(0);
  }
  /// The ID must be one that the wire has, and above those that are there; throws
  /// std::invalid_argument otherwise.
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
    find_addresses();
  }
  /// Some drive answers elsewhere from now on.
  void find_addresses() {
    const auto before = at_address_;
    at_address_.fill(0);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      const Servo& servo = nodes_[n].servo;
      if (!servo.on_its_bus() || !servo.at_its_rate()) continue;
      at_address_[static_cast<std::size_t>(servo.address())] |= 1U << n;
    }
    if (at_address_ != before) ++moves_;
  }
  /// How often some drive has come to be found elsewhere.
  std::uint64_t moves() const { return moves_; }
  /// The drives that hear what is sent to the ID, as bits that `each` takes; 0: none.
  std::uint32_t at_address(int id) const {
    return id >= protocol::kMinId && id <= protocol::kMaxId
               ? at_address_[static_cast<std::size_t>(id)]
               : 0;
  }
  /// Calls `act` with each of them.
  template <class Act>
  void each(std::uint32_t bits, Act act) {
    for (; bits != 0; bits &= bits - 1) {
      act(nodes_[static_cast<std::size_t>(std::countr_zero(bits))]);
    }
  }
  /// Calls `act` with each that hears its bus, by the addresses that they have now.
  template <class Act>
  void each_by_address(Act act) {
    for (const std::uint32_t bits : std::array(at_address_)) each(bits, act);
  }
  bool has(int id) const {
    return id >= protocol::kMinId && id <= protocol::kMaxId &&
           index_of_id_[static_cast<std::size_t>(id)] >= 0;
  }
  // Throws std::out_of_range when the drive `id` is not on the bus.
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
  std::array<std::uint32_t, protocol::kMaxId + 1> at_address_{};  // a bit for each drive
  std::uint64_t moves_ = 0;
};

}  // namespace lk::emulator

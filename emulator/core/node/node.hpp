#pragma once

#include <array>
#include <cassert>
#include <cstdint>
#include <span>
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

  int id() const { return servo.id(); }
};

/// The drives of a bus, by ID, ascending. The ID is all that tells one from the other.
class Nodes {
 public:
  Nodes() { index_of_id_.fill(-1); }
  /// The ID must be above those that are there.
  void add(Node node) {
    assert(!has(node.id()) && (nodes_.empty() || node.id() > nodes_.back().id()));
    index_of_id_[static_cast<std::size_t>(node.id())] = static_cast<std::int8_t>(nodes_.size());
    nodes_.push_back(std::move(node));
  }
  bool has(int id) const {
    return id >= protocol::kMinId && id <= protocol::kMaxId &&
           index_of_id_[static_cast<std::size_t>(id)] >= 0;
  }
  Node& of(int id) { return nodes_[index_of(id)]; }
  const Node& of(int id) const { return nodes_[index_of(id)]; }
  std::size_t size() const { return nodes_.size(); }
  auto begin() { return nodes_.begin(); }
  auto end() { return nodes_.end(); }
  auto begin() const { return nodes_.begin(); }
  auto end() const { return nodes_.end(); }

 private:
  std::size_t index_of(int id) const {
    assert(has(id));
    return static_cast<std::size_t>(index_of_id_[static_cast<std::size_t>(id)]);
  }
  std::vector<Node> nodes_;
  std::array<std::int8_t, protocol::kMaxId + 1> index_of_id_{};  // −1 = not on the bus
};

}  // namespace lk::emulator

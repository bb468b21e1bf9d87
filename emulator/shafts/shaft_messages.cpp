#include "emulator/shafts/shaft_messages.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace lk::emulator {
namespace {

constexpr std::size_t kLongestReason = 1000;

ShaftBytes message(std::uint32_t kind, std::uint32_t joints, std::uint32_t what,
                   std::uint64_t number) {
  ShaftBytes bytes(lk_shafts_bytes(kind, joints));
  const lk_shafts_head head{kind, static_cast<std::uint32_t>(bytes.size()), joints, what, number};
  lk_shafts_put_head(bytes.data(), &head);
  return bytes;
}

}  // namespace

ShaftBytes offer_message(std::span<const lk_shafts_offer> offers, std::uint64_t step_ns) {
  const auto joints = static_cast<std::uint32_t>(offers.size());
  ShaftBytes bytes = message(LK_SHAFTS_OFFER, joints, 0, step_ns);
  for (std::uint32_t n = 0; n < joints; ++n) {
    lk_shafts_put_offer(&bytes[lk_shafts_at(LK_SHAFTS_OFFER, n)], &offers[n]);
  }
  return bytes;
}

ShaftBytes torques_message(std::span<const lk_shafts_torque> torques, std::uint32_t steps,
                           std::uint64_t number) {
  const auto joints = static_cast<std::uint32_t>(torques.size());
  ShaftBytes bytes = message(LK_SHAFTS_TORQUES, joints, steps, number);
  for (std::uint32_t n = 0; n < joints; ++n) {
    lk_shafts_put_torque(&bytes[lk_shafts_at(LK_SHAFTS_TORQUES, n)], &torques[n]);
  }
  return bytes;
}

ShaftBytes end_message(std::string_view why) {
  why = why.substr(0, kLongestReason);
  const std::size_t padded = (why.size() + 7) / 8 * 8;
  ShaftBytes bytes(LK_SHAFTS_HEAD_BYTES + padded);
  const lk_shafts_head head{LK_SHAFTS_END, static_cast<std::uint32_t>(bytes.size()), 0,
                            static_cast<std::uint32_t>(why.size()), 0};
  lk_shafts_put_head(bytes.data(), &head);
  std::ranges::copy(why, bytes.begin() + LK_SHAFTS_HEAD_BYTES);
  return bytes;
}

std::size_t ShaftReader::wants() const {
  const std::size_t whole =
      bytes_.size() < LK_SHAFTS_HEAD_BYTES ? LK_SHAFTS_HEAD_BYTES : head_.bytes;
  return whole - bytes_.size();
}

ShaftReader::Message ShaftReader::take(std::span<const unsigned char> bytes) {
  assert(bytes.size() <= wants());
  if (!wrong_.empty()) return wrong_;
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  if (bytes_.size() < LK_SHAFTS_HEAD_BYTES) return More{};
  if (bytes_.size() == LK_SHAFTS_HEAD_BYTES) {
    const char* const wrong = lk_shafts_get_head(bytes_.data(), &head_);
    if (wrong != nullptr) {
      wrong_ = std::string("sent a message that ") + wrong;
    } else if (head_.kind != LK_SHAFTS_ACCEPT && head_.kind != LK_SHAFTS_STATES) {
      wrong_ = "sent a message of a kind that only lk-emu sends";
    } else if (head_.joints != joints_) {
      wrong_ = "sent a message of " + std::to_string(head_.joints) + " joints where there are " +
               std::to_string(joints_);
    }
    if (!wrong_.empty()) return wrong_;
  }
  if (bytes_.size() < head_.bytes) return More{};
  const ShaftBytes whole = std::exchange(bytes_, {});
  if (head_.kind == LK_SHAFTS_ACCEPT) {
    ShaftAccept accept{head_, std::vector<lk_shafts_accept>(joints_)};
    for (std::uint32_t n = 0; n < joints_; ++n) {
      lk_shafts_get_accept(&whole[lk_shafts_at(LK_SHAFTS_ACCEPT, n)], &accept.records[n]);
    }
    return accept;
  }
  ShaftStates states{head_, std::vector<lk_shafts_state>(joints_)};
  for (std::uint32_t n = 0; n < joints_; ++n) {
    lk_shafts_get_state(&whole[lk_shafts_at(LK_SHAFTS_STATES, n)], &states.records[n]);
  }
  return states;
}

}  // namespace lk::emulator

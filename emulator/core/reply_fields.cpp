#include "emulator/core/reply_fields.hpp"

namespace lk::emulator {
namespace {

using protocol::Reply;

/// `read` of a reply of this kind; nothing of any other.
template <class Kind, class Read>
std::optional<double> of(const Reply& reply, Read read) {
  const auto* const kind = std::get_if<Kind>(&reply);
  return kind != nullptr ? std::optional<double>(read(*kind)) : std::nullopt;
}

std::optional<double> temperature_C(const Reply& reply) {
  const auto read = [](const auto& state) { return state.temperature_C; };
  if (const auto state_1 = of<protocol::State1>(reply, read)) return state_1;
  if (const auto state_2 = of<protocol::State2>(reply, read)) return state_2;
  return of<protocol::State3>(reply, read);
}

std::optional<double> angle_deg(const Reply& reply) {
  const auto read = [](const auto& angle) { return 0.01 * static_cast<double>(angle.angle_cdeg); };
  if (const auto multi_turn = of<protocol::MultiTurnAngle>(reply, read)) return multi_turn;
  return of<protocol::SingleTurnAngle>(reply, read);
}

std::optional<double> encoder(const Reply& reply) {
  const auto read = [](const auto& said) { return static_cast<double>(said.encoder_counts); };
  if (const auto state_2 = of<protocol::State2>(reply, read)) return state_2;
  return of<protocol::Encoder>(reply, read);
}

// One row a line.
// clang-format off
constexpr ReplyField kFields[] = {
    {"temperature_C", temperature_C},
    {"voltage_V", [](const Reply& r) { return of<protocol::State1>(r, [](const auto& s) { return s.voltage_V; }); }},
    {"iq_A", [](const Reply& r) { return of<protocol::State2>(r, [](const auto& s) { return s.iq_A; }); }},
    {"speed_dps", [](const Reply& r) { return of<protocol::State2>(r, [](const auto& s) { return s.speed_dps; }); }},
    {"encoder", encoder},
    {"angle_deg", angle_deg},
    {"offset", [](const Reply& r) { return of<protocol::Encoder>(r, [](const auto& e) { return static_cast<double>(e.offset_counts); }); }},
};
// clang-format on

}  // namespace

std::span<const ReplyField> reply_fields() { return kFields; }

std::optional<unsigned> reply_errors(const Reply& reply) {
  const auto* const state = std::get_if<protocol::State1>(&reply);
  return state != nullptr ? std::optional<unsigned>(state->errors) : std::nullopt;
}

}  // namespace lk::emulator

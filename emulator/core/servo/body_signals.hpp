#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

/// Signals of a body: "body.fallen", and for each part "body.trunk.z_m". One object for all buses
/// of a robot; its signals are valid while it exists.
class BodySignals {
 public:
  /// `parts`: names in Mechanism::parts(). A part has no signals if its name is empty or cannot be
  /// in a comma list. `beginning`: initial state of the body.
  BodySignals(std::span<const std::string> parts, BodyState beginning);
  BodySignals(const BodySignals&) = delete;
  BodySignals& operator=(const BodySignals&) = delete;
  ~BodySignals() = default;

  std::span<const Signal> all() const { return signals_; }
  const BodyState& beginning() const { return beginning_; }

 private:
  std::vector<std::string> names_;
  std::vector<Signal> signals_;
  BodyState beginning_;
};

/// Row of the table behind BodySignals.
struct BodySignal {
  std::string_view name;  // "z_m", of a part; "fallen"
  std::string_view about;
  double (*read)(const BodyState& body, std::size_t part);
  bool of_part;
};
std::span<const BodySignal> body_signal_table();

/// Prefix of the names of body signals.
inline constexpr std::string_view kBodyPrefix = "body.";

/// Returns all signals of a drive, and those of `body` unless it is null.
std::vector<const Signal*> signals_with(const BodySignals* body);

}  // namespace lk::emulator

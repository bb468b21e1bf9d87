#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

/// What can be watched of a body: "body.fallen", and of each of its parts "body.trunk.z_m". One
/// for all buses of a robot; a signal lives as long as it does.
class BodySignals {
 public:
  /// `parts`: names, of Mechanism::parts(). Those without one have no signals, nor have those whose
  /// name cannot stand in a list with commas. `beginning`: of the body as it starts.
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

/// One of the table behind BodySignals.
struct BodySignal {
  std::string_view name;  // "z_m", of a part; "fallen"
  std::string_view about;
  double (*read)(const BodyState& body, std::size_t part);
  bool of_part;
};
std::span<const BodySignal> body_signal_table();

/// Names of signals of a body begin with it.
inline constexpr std::string_view kBodyPrefix = "body.";

/// All of a drive, and of the body, which may be null.
std::vector<const Signal*> signals_with(const BodySignals* body);

}  // namespace lk::emulator

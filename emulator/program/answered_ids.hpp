#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "emulator/live/line.hpp"
#include "emulator/transports/id_locks.hpp"

namespace lk::emulator {

/// The IDs that the drives of this run answer at: locked for them, and told where they are not the
/// configured ones.
class AnsweredIds {
 public:
  /// As configured, before anything is made. `link` is what the kernel says of the interface.
  /// Throws StartError where another program answers for one.
  void take(const BusConfig& bus, const LinkState& link);
  /// As ROM has them: what is in force is locked, the rest is free. Throws StartError like `take`.
  void start(const Line& line);
  /// Some drive has come to be found elsewhere; where another program answers already, both do.
  void follow(const Line& line);
  void hang_up() const { locks_.hang_up(); }

 private:
  enum class Taken : std::uint8_t { kOrFail, kOrWarn };
  void lock(const Line& line, Taken taken);
  void tell(const Line& line);

  using Drive = std::pair<std::string, int>;  // an interface and an ID
  IdLocks locks_;
  std::map<std::string, LinkState> links_;  // by interface
  std::map<Drive, std::string> told_;       // by configured ID
  std::set<Drive> shared_;                  // that another program answers for too, which was told
};

/// " (7 answers at ID 9)" for the drives that are not where they are configured; else empty.
std::string moved_text(const Line& line);

}  // namespace lk::emulator

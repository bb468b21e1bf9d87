#pragma once

#include <string>
#include <vector>

#include "emulator/files/durable_file.hpp"
#include "emulator/transports/netlink.hpp"

namespace lk::emulator {

/// Keeps two programs from answering for the same drive, since each would take the other's replies
/// for queries. A lock is an abstract Unix socket named after interface and ID: all processes of
/// the network namespace compete for it, whoever owns them, and the kernel frees it however its
/// holder ends (docs/decisions/0014-one-answer-per-id.md).
class IdLocks {
 public:
  /// Takes the drive `id` on `interface`, and at the other end of a vxcan pair as well. `link` is
  /// what the kernel says of the interface; it need not exist yet. Throws StartError that tells who
  /// has it, and what to do about it: stop that, or else `remedy`.
  void take(const std::string& interface, const LinkState& link, int id,
            const std::string& remedy = "give other --ids");
  /// Lets go of the drive `id` on `interface`, if it holds it.
  void release(const std::string& interface, int id);
  bool holds(const std::string& interface, int id) const;
  /// Lets go of those who have asked who we are. Now and then, or the next ones are not told.
  void hang_up() const;

 private:
  struct Held {
    std::string interface;
    int id;
    Descriptor socket;
  };
  std::vector<Held> held_;
};

}  // namespace lk::emulator

#pragma once

#include <string>
#include <vector>

#include "emulator/files/durable_file.hpp"
#include "emulator/io/transports/netlink.hpp"

namespace lk::emulator {

/// Keeps two programs from answering for the same drive: each would take the other's replies for
/// queries. The lock of a drive is an abstract Unix socket named after interface and ID. All
/// processes of the network namespace compete for it, and the kernel frees it when its holder ends
/// (docs/internals/decisions/0014-one-answer-per-id.md).
class IdLocks {
 public:
  /// Locks the drive `id` on `interface`, and on the other end of a vxcan pair. `link`: state of
  /// the interface, which need not exist. Throws StartError if a lock is held; the message names
  /// the holder and what to do: stop it, or `remedy`.
  void take(const std::string& interface, const LinkState& link, int id,
            const std::string& remedy = "give other --ids");
  /// Releases the lock of drive `id` on `interface`, if held.
  void release(const std::string& interface, int id);
  bool holds(const std::string& interface, int id) const;
  /// Closes the connections of programs that connected to a lock to get the PID of its holder. Call
  /// regularly.
  void drain_queue() const;

 private:
  struct Held {
    std::string interface;
    int id;
    Descriptor socket;
  };
  std::vector<Held> held_;
};

}  // namespace lk::emulator

#pragma once

#include <poll.h>

#include <filesystem>
#include <functional>
#include <list>
#include <string>
#include <vector>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

/// Stands between a host and the control socket of its lk-emu, and passes bytes on. Time stands
/// until the host moves it, by a request: whatever the host has said before, it has said at the
/// instant at which time stands. So `before_request` is called before any byte of it is passed on.
class ControlRelay {
 public:
  /// Listens at `path`. Throws StartError.
  ControlRelay(const std::filesystem::path& path, std::filesystem::path control,
               std::function<void()> before_request);

  /// What to wait for.
  void add_to(std::vector<pollfd>& waits) const;
  /// `ready` is what `add_to` has added, after the wait.
  void serve(const pollfd* ready);

 private:
  struct Way {
    std::string waiting;  // read, not written yet
    bool ended = false;   // no more will be read
    bool told = false;    // and the other side knows
  };
  struct Client {
    Descriptor host, emulator;
    Way request, answer;
  };
  void let_in();
  static short events_of(const Way& in, const Way& out);
  bool serve(Client& client, short host, short emulator) const;

  std::filesystem::path control_;
  std::function<void()> before_request_;
  Descriptor listener_;
  std::list<Client> clients_;
};

}  // namespace lk::emulator

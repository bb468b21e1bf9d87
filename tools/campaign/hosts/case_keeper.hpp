#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

/// A program as it is to be started.
struct Program {
  std::string path;
  std::vector<std::string> arguments;    // the first is its name
  std::vector<std::string> environment;  // "NAME=value"
  std::string directory;                 // empty: this process's
  int out = -1;                          // standard output; input is empty
  int error = -1;                        // standard error
};

/// The processes of one case, kept by a process of their own that outlives none of them: it ends
/// lk-emu, the host and whatever these have started, in groups and sessions of their own too, when
/// it is told to, and when this process is gone, however that ended.
class CaseKeeper {
 public:
  /// Nothing is started yet. `directory` is the case's, and gone in the end, with the files in it.
  /// `own_network`: in a network namespace of their own, in which they may make interfaces.
  CaseKeeper(const Program& emulator, const Program& host, const std::string& directory,
             bool own_network);
  CaseKeeper(const CaseKeeper&) = delete;
  CaseKeeper& operator=(const CaseKeeper&) = delete;
  /// Nothing is left after this.
  ~CaseKeeper();

  void start_emulator() { tell(kStartEmulator); }
  void start_host() { tell(kStartHost); }
  /// Ends the host and all but lk-emu; kOthersEnded comes when that is done.
  void end_others() { tell(kEndOthers); }

  enum class What : char {
    kEmulatorEnded,  // `value` is what wait() gives
    kHostEnded,      // the same
    kOthersEnded,
    kNoNetwork,       // `value` is errno, as below
    kEmulatorAbsent,  // could not be started
    kHostAbsent,
  };
  struct Event {
    What what = What::kEmulatorEnded;
    int value = 0;
  };
  /// Can be read when there is an event.
  int descriptor() const { return control_.get(); }
  /// The next one; nothing when there is none yet. Throws StartError when the keeper is gone.
  std::optional<Event> take();

 private:
  enum Order : char { kStartEmulator = 'e', kStartHost = 'h', kEndOthers = 'o' };
  void tell(Order order) const;

  Descriptor control_;
  pid_t keeper_ = -1;
};

}  // namespace lk::emulator

#include "emulator/core/bus_stats.hpp"

namespace lk::emulator {

std::string_view to_string(Drop cause) {
  switch (cause) {
    case Drop::kErrorFrame:
      return "error frame";
    case Drop::kCanFd:
      return "CAN FD frame";
    case Drop::kRemote:
      return "remote request";
    case Drop::kExtended:
      return "extended identifier";
    case Drop::kForeignId:
      return "foreign identifier";
    case Drop::kNoSuchDrive:
      return "no such drive";
    case Drop::kWrongLength:
      return "wrong length";
    case Drop::kUnknownCommand:
      return "unknown command";
    case Drop::kWrongMode:
      return "wrong mode";
    case Drop::kNoPower:
      return "drive without power";
    case Drop::kDriveBusy:
      return "drive busy";
    case Drop::kFault:
      return "injected fault";
    case Drop::kQueueFull:
      return "queue full";
    case Drop::kNoPacket:
      return "no packet";
  }
  return "?";
}

}  // namespace lk::emulator

#include "emulator/core/generation.hpp"

namespace lk::emulator {

Quirks quirks_of(Generation generation) {
  Quirks quirks;
  switch (generation) {
    case Generation::kLegacy:
      break;
    case Generation::kV235:
      quirks.dialect = protocol::kV235Dialect;
      quirks.run_resumes = false;
      break;
    case Generation::kV236:
      quirks.dialect = protocol::kV236Dialect;
      quirks.run_resumes = false;
      break;
  }
  return quirks;
}

}  // namespace lk::emulator

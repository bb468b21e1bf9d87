#pragma once

namespace lk::emulator {

/// Registers the simulator of robot bodies (use_bodies), if the program has one. Defined in
/// with_bodies.cpp or without_bodies.cpp.
void provide_bodies();

}  // namespace lk::emulator

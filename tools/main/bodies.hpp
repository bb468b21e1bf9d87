#pragma once

namespace lk::emulator {

/// Makes the bodies of robots known to the program that has them (use_bodies): with_bodies.cpp or
/// without_bodies.cpp.
void provide_bodies();

}  // namespace lk::emulator

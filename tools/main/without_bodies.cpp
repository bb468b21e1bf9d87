#include "tools/main/bodies.hpp"

void lk::emulator::provide_bodies() {}

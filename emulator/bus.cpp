#include "emulator/bus.hpp"

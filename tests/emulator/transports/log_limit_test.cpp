#include <gtest/gtest.h>

#include "emulator/io/transports/socket_listener.hpp"

namespace lk::emulator {
namespace log_limit_test {

/// All within ten seconds, unless the machine stalls for that long.
TEST(LogLimit, AllowsTwentyMessagesPerPeriod) {
  LogLimit limit;
  int told = 0;
  for (int n = 0; n < 1000; ++n) told += limit.may_log("vcan0") ? 1 : 0;
  EXPECT_EQ(told, 20);
}

}  // namespace log_limit_test
}  // namespace lk::emulator

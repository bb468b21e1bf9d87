#include "tools/cases/traffic_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace traffic_watch_test {

using namespace std::chrono_literals;

Traffic of_drive(const char* text, SimTime at = 1ms, std::size_t bus = 0) {
  return {bus, {at, test::frame(text)}, false};
}
Traffic of_host(const char* text, SimTime at = 1ms, std::size_t bus = 0) {
  return {bus, {at, test::frame(text)}, true};
}
std::uint64_t heard(const std::vector<Traffic>& traffic) {
  TrafficWatch watch;
  watch.observe(traffic);
  return watch.reply_hash();
}

constexpr const char* kReply = "141#9C19000000000000";

TEST(TrafficWatch, DistinguishesReplies) {
  const std::uint64_t one = heard({of_drive(kReply)});
  EXPECT_EQ(heard({of_drive(kReply)}), one);
  EXPECT_NE(heard({}), one);
  EXPECT_NE(heard({of_drive("142#9C19000000000000")}), one);
  EXPECT_NE(heard({of_drive("141#9C19000000000001")}), one);
  EXPECT_NE(heard({of_drive("141#199C000000000000")}), one);
  EXPECT_NE(heard({of_drive("141#9C190000000000")}), one);  // shorter by a 0
  EXPECT_NE(heard({of_drive(kReply, 2ms)}), one);
  EXPECT_NE(heard({of_drive(kReply, 1ms, 1)}), one);
  EXPECT_NE(heard({of_drive(kReply), of_drive(kReply)}), one);
}

TEST(TrafficWatch, DistinguishesFrameFlags) {
  EXPECT_NE(heard({of_drive("141#R8")}), heard({of_drive("141#0000000000000000")}));
  EXPECT_NE(heard({of_drive("00000141#9C19000000000000")}), heard({of_drive(kReply)}));
}

TEST(TrafficWatch, IsIndependentOfChunking) {
  TrafficWatch watch;
  watch.observe({of_drive(kReply), of_host("141#9C00000000000000", 2ms)});
  const TrafficWatch copy = watch;
  watch.observe({});
  watch.observe({of_drive(kReply, 3ms)});
  EXPECT_EQ(watch.reply_hash(), heard({of_drive(kReply), of_drive(kReply, 3ms)}));
  EXPECT_EQ(copy.reply_hash(), heard({of_drive(kReply)}));
}

TEST(TrafficWatch, IgnoresHostFrames) {
  EXPECT_EQ(heard({of_host("141#9C00000000000000")}), heard({}));
}

TEST(TrafficWatch, KnowsTheLatestCommandOfEachDrive) {
  TrafficWatch watch;
  EXPECT_EQ(watch.command(0, 1), std::nullopt);
  watch.observe({of_host("141#9C00000000000000"), of_host("142#A400000000000000"),
                 of_host("141#9A00000000000000", 1ms, 1), of_host("141#")});
  EXPECT_EQ(watch.command(0, 1), 0x9C);
  EXPECT_EQ(watch.command(0, 2), 0xA4);
  EXPECT_EQ(watch.command(1, 1), 0x9A);
  EXPECT_EQ(watch.command(1, 2), std::nullopt);
  watch.observe({of_host("141#8000000000000000", 2ms), of_drive(kReply, 3ms)});
  EXPECT_EQ(watch.command(0, 1), 0x80);
}

}  // namespace traffic_watch_test
}  // namespace lk::emulator

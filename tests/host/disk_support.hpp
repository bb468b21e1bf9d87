#pragma once

/// @file A directory that acts as a disk, and the files written to it.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/host/machine_support.hpp"

namespace lk::host {

class DiskTest : public MachineTest {
 protected:
  explicit DiskTest(std::string bus = own_bus()) : MachineTest(std::move(bus)) {
    std::filesystem::create_directory(path("disk"));
  }

  /// Writes a scenario with a send and an expectation.
  std::string scenario(const std::string& duration_s) const {
    own_.put("robot.toml", "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"1-4\"\n");
    return own_.put("scenario.toml",
                    "robot = \"robot.toml\"\nduration_s = " + duration_s +
                        "\n[[send]]\nat_s = 0\nid = 1\ncommand = \"state_2\"\nevery_s = 0.001\n"
                        "[[expect]]\nid = 1\nsignal = \"alive\"\nmin = 1\n");
  }
  std::vector<std::string> names_on_disk() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path("disk"))) {
      if (entry.path().filename() != "filler") names.push_back(entry.path().filename());
    }
    return names;
  }

  /// Expects that the recording into the directory `recording` ends, and the program continues.
  void expect_recording_to_end(const std::string& recording, const std::string& why,
                               std::vector<std::string> launcher = {}) {
    // The log goes to a file, because this test sends frames and cannot read a pipe meanwhile.
    const std::vector<std::string> logging = {"sh", "-c", "exec \"$@\" 2>" + path("log"), "sh"};
    launcher.insert(launcher.end(), logging.begin(), logging.end());
    StartedEmulator emulator(arguments({"--record", recording}), launcher);
    Host host(bus_);
    ASSERT_TRUE(talk_until_log(host, "recording in " + recording + " has ended: " + why));
    EXPECT_NE(get("/status").body.find("\"failed\":true"), std::string::npos);
    for (int n = 0; n < 100; ++n) ASSERT_TRUE(host.query(2, kReadState2)) << "drives go on";
    EXPECT_EQ(emulator.stop().status, 0);
    EXPECT_EQ(count_of(text_of(path("log")), "has ended"), 1);
    const auto again = EmulatorProcess({"replay", recording}).wait();
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.out.find("identical up to "), std::string::npos) << again.out;
  }

 private:
  /// Keeps querying a drive until the log contains `text`; returns false if it does not answer.
  bool talk_until_log(Host& host, const std::string& text) const {
    bool answered = true;
    const bool over = wait_until([&] {
      for (int n = 0; n < 20 && answered; ++n) answered = host.query(1, kReadState2).has_value();
      return !answered || text_of(path("log")).find(text) != std::string::npos;
    });
    return over && answered;
  }
};

}  // namespace lk::host

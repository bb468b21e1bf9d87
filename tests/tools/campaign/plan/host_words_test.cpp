// The command of a host program in a plan.

#include "tools/campaign/plan/host_words.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "emulator/config/config_error.hpp"
#include "tests/support/temp_directory.hpp"
#include "tests/tools/campaign/plan/plan_support.hpp"

namespace lk::emulator {
namespace host_words_test {

constexpr const char* kJam = "fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = 1\n";

Plan plan_with(const std::string& host) { return plan_of("full", kJam, "[host]\n" + host); }

TEST(HostWords, ACommandLineIsItsWords) {
  using Words = std::vector<std::string>;
  EXPECT_EQ(command_words("python3  my_host.py --gain {host.gain}\n"),
            (Words{"python3", "my_host.py", "--gain", "{host.gain}"}));
  EXPECT_EQ(command_words(R"(sh -c 'echo "$1" *' "" a"b c"'d')"),
            (Words{"sh", "-c", "echo \"$1\" *", "", "ab cd"}));
  EXPECT_EQ(command_words(" "), Words{});
  EXPECT_THROW(command_words("echo 'no end"), std::invalid_argument);
}

TEST(HostWords, APlanHasThemAsATextOrAsAList) {
  using Words = std::vector<std::string>;
  const Words words = {"python3", "my_host.py", "--gain", "{host.gain}"};
  EXPECT_EQ(plan_with("command = \"python3 my_host.py --gain {host.gain}\"").host->command, words);
  EXPECT_EQ(
      plan_with(R"(command = ["python3", "my_host.py", "--gain", "{host.gain}"])").host->command,
      words);
  try {
    plan_with("command = \"sh -c 'no end\"");
    ADD_FAILURE();
  } catch (const ConfigError& wrong) {
    EXPECT_EQ(wrong.key, "host.command");
    EXPECT_EQ(wrong.reason, "no end of '");
  }
  EXPECT_THROW(plan_with("command = \" \""), ConfigError);
}

// One run of a case in real time shows nothing of what comes otherwise at another time.
TEST(HostWords, InRealTimeEachCaseRunsTwiceWhereNothingIsSaid) {
  EXPECT_EQ(plan_with("command = \"true\"").host->runs, 2);
  EXPECT_EQ(plan_with("command = \"true\"\nruns = 1").host->runs, 1);
  EXPECT_EQ(plan_with("command = \"true\"\nclock = \"stepped\"").host->runs, 1);
}

// Results of another version of the host are of another campaign.
TEST(HostWords, WhatIsInTheFilesOfTheCommandGoesIntoTheHash) {
  const test::TempDirectory own;
  const std::string script = own.put("host.py", "print(1)\n");
  const std::string command = "command = \"python3 " + script + "\"";
  const std::string before = plan_with(command).head.input_hash;
  EXPECT_EQ(plan_with(command).head.input_hash, before);
  own.put("host.py", "print(2)\n");
  EXPECT_NE(plan_with(command).head.input_hash, before);
  // From the plan's directory, where the host runs too.
  EXPECT_EQ(files_hash({"host.py"}, own.path(""), 1), files_hash({script}, "/", 1));
  EXPECT_NE(files_hash({"host.py"}, own.path(""), 1), 1U);
  EXPECT_EQ(files_hash({"host", "", "."}, own.path(""), 1), 1U);
}

TEST(HostWords, NoTwoCasesHaveTheSameKey) {
  const CaseValues one = {"a|b", "c"}, other = {"a", "b|c"};
  EXPECT_NE(key_of(one), key_of(other));
  EXPECT_NE(key_of({"", std::nullopt}), key_of({std::nullopt, ""}));
  EXPECT_EQ(key_of(one), key_of({"a|b", "c"}));
}

}  // namespace host_words_test
}  // namespace lk::emulator

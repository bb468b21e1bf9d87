// Messages for unusable input. No bus is needed, since the input is checked first.

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace cli_test {

struct BadInput {
  const char* name;
  std::vector<std::string> arguments;
  const char* message;  // beginning of the only line
};

class Refused : public testing::TestWithParam<BadInput> {};

TEST_P(Refused, PrintsOneLineAndExitsWithStatus2) {
  const auto result = EmulatorProcess(GetParam().arguments).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err.rfind(GetParam().message, 0), 0U) << result.err;
  EXPECT_EQ(result.err.find('\n'), result.err.size() - 1) << result.err;
}

const BadInput kBadInput[] = {
    {"Nothing", {}, "lk-emu: no bus"},
    {"IdTooSmall", {"--bus", "vcan0", "--ids", "0"}, "lk-emu: --ids: ID 0 is outside 1..32"},
    {"IdsMissing", {"--bus", "vcan0"}, "lk-emu: bus vcan0 has no drives"},
    {"IdsBeforeBus", {"--ids", "1", "--bus", "vcan0"}, "lk-emu: --ids 1 has no --bus before it"},
    {"IdsTwice", {"--bus", "a", "--ids", "1", "--ids", "2"}, "lk-emu: --bus a has two --ids"},
    {"BusTwice", {"--bus", "a", "--ids", "1", "--bus", "a"}, "lk-emu: --bus: a is given twice"},
    {"BusNameTooLong",
     {"--bus", "sixteencharacter", "--ids", "1"},
     "lk-emu: --bus: \"sixteencharacter\" is longer than an interface name can be"},
    {"UnknownMotor",
     {"--bus", "vcan0", "--ids", "1", "--motor", "mf7105"},
     "lk-emu: --motor: no motor \"mf7105\", did you mean mf7015? (in "},
    {"NoMotorFile",
     {"--bus", "vcan0", "--ids", "1", "--motor", "./nowhere.toml"},
     "lk-emu: --motor: cannot read ./nowhere.toml: No such file or directory"},
    {"UnknownRobot",
     {"--config", "quadrupd"},
     "lk-emu: no robot \"quadrupd\", did you mean quadruped? (in "},
    {"UnknownScenario",
     {"run", "jamed_joint"},
     "lk-emu: no scenario \"jamed_joint\", did you mean jammed_joint? (in "},
    {"UnknownScenarioOfARun",
     {"--check", "--config", "bench", "--scenario", "nothing_like_it"},
     "lk-emu: no scenario \"nothing_like_it\" (in "},
    {"UnknownScenarioForARunningOne",
     {"ctl", "scenario", "jamed_joint"},
     "lk-emu: ctl: no scenario \"jamed_joint\", did you mean jammed_joint? (in "},
    {"GenerationTwice",
     {"--bus", "a", "--ids", "1", "--generation", "v235", "--generation", "v236"},
     "lk-emu: --generation is given twice for the same drives"},
    {"MotorOfTwoGears",
     {"--bus", "a", "--ids", "1", "--motor", "MG6012"},
     "lk-emu: --motor: no motor \"MG6012\", did you mean mg6012-i36 or mg6012-i8? (in "},
    {"MotorWithAGear",
     {"--bus", "a", "--ids", "1", "--motor", "MG5210-i10"},
     "lk-emu: --motor: no motor \"MG5210-i10\", did you mean mg5210? (in "},
    {"MotorOfAnotherGear",
     {"--bus", "a", "--ids", "1", "--motor", "MG5010E-i37"},
     "lk-emu: --motor: no motor \"MG5010E-i37\" (in "},
    {"MotorOfAnotherWinding",
     {"--bus", "a", "--ids", "1", "--motor", "MF9025v2-36T"},
     "lk-emu: --motor: no motor \"MF9025v2-36T\" (in "},
    {"MotorWithoutAGear",
     {"--bus", "a", "--ids", "1", "--motor", "MG5010E"},
     "lk-emu: --motor: no motor \"MG5010E\", did you mean MG5010E-i10 or MG5010E-i36? (in "},
    {"MotorWithTypingError",
     {"--bus", "a", "--ids", "1", "--motor", "MG5001E-i36"},
     "lk-emu: --motor: no motor \"MG5001E-i36\", did you mean MG5010E-i36? (in "},
    {"MotorOfAnotherGearWithTypingError",
     {"--bus", "a", "--ids", "1", "--motor", "MG8061E-i36"},
     "lk-emu: --motor: no motor \"MG8061E-i36\" (in "},
    {"MotorOfAnotherWindingWithTypingError",
     {"--bus", "a", "--ids", "1", "--motor", "MF9052-35T"},
     "lk-emu: --motor: no motor \"MF9052-35T\", did you mean mf9025-35t? (in "},
    {"RmdByItsSize",
     {"--bus", "a", "--ids", "1", "--motor", "RMD-L-9025"},
     "lk-emu: --motor: no motor \"RMD-L-9025\", did you mean mf9025 or mf9025-35t? (in "},
    {"RmdOfAWinding",
     {"--bus", "a", "--ids", "1", "--motor", "RMD-L-9025-35T"},
     "lk-emu: --motor: no motor \"RMD-L-9025-35T\", did you mean mf9025-35t? (in "},
    {"RmdOfAnotherGear",
     {"--bus", "a", "--ids", "1", "--motor", "RMD-X8-S2"},
     "lk-emu: --motor: no motor \"RMD-X8-S2\" (in "},
    {"EncoderBitsOfNoDrive",
     {"--bus", "a", "--ids", "1", "--quirk", "encoder_bits=15"},
     "lk-emu: --quirk: encoder_bits: must be 14 or 16"},
    {"EncoderBitsOfAnotherSeries",
     {"--bus", "a", "--ids", "1", "--motor", "MG5010E-i36", "--quirk", "encoder_bits=14"},
     "lk-emu: --quirk: encoder_bits: mg5010-i36 has 16 only: MG drives show the upper 16 of 18 "
     "bits; "
     "MF and MH have 14 or 16"},
    {"MotorOfAnotherSize",
     {"--bus", "a", "--ids", "1", "--motor", "mg4006-i10"},
     "lk-emu: --motor: no motor \"mg4006-i10\" (in "},
    {"MotorShippedByItsName",
     {"--bus", "a", "--ids", "1", "--motor", "mf7015.toml"},
     "lk-emu: --motor: cannot read mf7015.toml: No such file or directory; the shipped one is "
     "called mf7015"},
    {"MotorOfAnotherVersion",
     {"--bus", "a", "--ids", "1", "--motor", "MG6012E-i36v3", "--generation", "seen"},
     "lk-emu: --generation: a drive 1 (mg6012-i36): the generation of"},
    {"RobotShippedByItsName",
     {"--config", "quadruped.toml"},
     "lk-emu: cannot read quadruped.toml: No such file or directory; the shipped one is called "},
    {"ScenarioShippedByItsName",
     {"run", "jammed_joint.toml"},
     "lk-emu: cannot read jammed_joint.toml: No such file or directory; the shipped one is "
     "called "},
    {"QuirkTwiceInCapitals",
     {"--quirk", "Stop_Holds = true", "--quirk", "stop_holds=false", "--bus", "a", "--ids", "1"},
     "lk-emu: --quirk: stop_holds is given twice for the same drives"},
    {"HttpWithoutAPort",
     {"--bus", "a", "--ids", "1", "--http", "localhost:"},
     "lk-emu: --http: localhost: needs a port, like localhost:8474"},
    {"HttpNameInBrackets",
     {"--bus", "a", "--ids", "1", "--http", "[localhost]:80"},
     "lk-emu: --http: \"[localhost]:80\" is not ADDR:PORT"},
    {"HttpLocalhostInCapitals",
     {"--bus", "a", "--ids", "1", "--http", "LOCALHOST:8474", "--motor", "none"},
     "lk-emu: --motor: no motor \"none\""},
    {"QuirkWithoutValue",
     {"--bus", "a", "--ids", "1", "--quirk", "stop_holds"},
     "lk-emu: --quirk: \"stop_holds\" is not NAME=VALUE, like pid_commands=true"},
    {"BitrateTooHigh",
     {"--bus", "vcan0", "--ids", "1", "--bitrate", "5000000"},
     "lk-emu: --bitrate: 5000000 is out of range"},
    {"OneFileForTwoOutputs",
     {"run", "jammed_joint", "--csv", "a.txt", "--candump", "a.txt"},
     "lk-emu: --candump: a.txt is the file of --csv already"},
    {"BootAngleNoNumber",
     {"--bus", "vcan0", "--ids", "1", "--boot-angle", "nan"},
     "lk-emu: --boot-angle: \"nan\" is not a number"},
    {"BootAngleOutOfRange",
     {"--bus", "vcan0", "--ids", "1", "--boot-angle", "361"},
     "lk-emu: --boot-angle: 361 is out of range (-360 to 360, a turn of the output) of vcan0 drive "
     "1"},
    {"SeedNoNumber",
     {"--bus", "vcan0", "--ids", "1", "--seed", "x"},
     "lk-emu: --seed: \"x\" is not a whole number"},
    {"SeedTooLarge",
     {"--bus", "vcan0", "--ids", "1", "--seed", "99999999999999999999"},
     "lk-emu: --seed: 99999999999999999999 is out of range"},
    {"BitrateHexadecimal",
     {"--bus", "vcan0", "--ids", "1", "--bitrate", "0x3e80"},
     "lk-emu: --bitrate: \"0x3e80\" is not a whole number"},
    {"SeedNegative",
     {"--bus", "vcan0", "--ids", "1", "--seed=-1"},
     "lk-emu: --seed: -1 is negative"},
    {"LogLevel",
     {"--bus", "vcan0", "--ids", "1", "--log-level", "loud"},
     "lk-emu: --log-level: \"loud\" is not one of"},
    {"RomNowhere", {"--bus", "a", "--ids", "1", "--rom", ""}, "lk-emu: --rom: needs a directory"},
    {"RomWipedInMemory",
     {"--bus", "a", "--ids", "1", "--wipe-rom", "--rom", ":memory:"},
     "lk-emu: --wipe-rom: not possible with --rom :memory:, which keeps nothing"},
    {"UnknownOption", {"--buss", "vcan0"}, "lk-emu: unknown option --buss, did you mean --bus?"},
    {"UnknownOptionOfACommand",
     {"ctl", "drives", "--jsn"},
     "lk-emu: unknown option --jsn, did you mean --json?"},
    {"UnknownCommand",
     {"runn", "pick.toml"},
     "lk-emu: no command \"runn\", did you mean run? (see lk-emu --help)"},
    {"UnknownCommandOfCtl",
     {"ctl", "drvies"},
     "lk-emu: no command \"drvies\", did you mean drives? (see lk-emu ctl --help)"},
    {"UnlikeAnyCommandOfCtl", {"ctl", "quux"}, "lk-emu: no command \"quux\" (see lk-emu ctl"},
    {"OneWordTooMany", {"ctl", "drives", "1"}, "lk-emu: \"1\" was not expected (see lk-emu ctl"},
    {"CommandBehindItsOptions",
     {"--lang", "zh", "run", "pick.toml"},
     "lk-emu: \"run\" has to come first: lk-emu run … (see lk-emu --help)"},
    {"NoDrive", {"ctl", "drive", "x"}, "lk-emu: ctl: drive: \"x\" is not an ID"},
    {"NoTime",
     {"ctl", "fault", "jam", "--for", "2x"},
     "lk-emu: ctl: \"2x\" is not a time, like 10ms, 1.5s or 2min"},
    {"TwoListsOfIds",
     {"ctl", "set", "id=1", "supply_V=18", "--ids", "1"},
     "lk-emu: ctl: IDs are given twice"},
    {"NoConfigFile",
     {"--config", "/nowhere.toml"},
     "lk-emu: cannot read /nowhere.toml: No such file"},
    {"MotorsWithOptionsOfARun",
     {"--bus", "vcan0", "--ids", "1", "motors", "mf7015"},
     "lk-emu: \"motors\" has to come first: lk-emu motors … (see lk-emu --help)"},
    {"CheckOfNothing", {"--check"}, "lk-emu: no bus: give --bus vcan0 --ids 1-4, or --config FILE"},
    {"CheckOfAnAddressForOthers",
     {"--check", "--bus", "a", "--ids", "1", "--http", "0.0.0.0:8474"},
     "lk-emu: --http: others can reach 0.0.0.0: give a --http-token FILE, or none"},
    {"CheckOfATokenFileCalledNone",
     {"--check", "--bus", "a", "--ids", "1", "--http-token", "none"},
     "lk-emu: --http-token: belongs to --http"},
    {"CheckOfAnAddressThatIsAName",
     {"--check", "--bus", "a", "--ids", "1", "--http", "robot:8474"},
     "lk-emu: --http: \"robot\" is not an IP address or localhost"},
    {"CheckOfAnotherNameOfThisMachine",
     {"--check", "--bus", "a", "--ids", "1", "--http", "localhost.example.com:8474"},
     "lk-emu: --http: \"localhost.example.com\" is not an IP address or localhost"},
    {"ConfigIsADirectory", {"--config", "/"}, "lk-emu: /: is a directory"},
};

INSTANTIATE_TEST_SUITE_P(Cli, Refused, testing::ValuesIn(kBadInput),
                         [](const auto& input) { return input.param.name; });

TEST(Cli, ConfigErrorsNameFileLineKeyAndReason) {
  const test::TempDirectory own;
  const std::string file = own.put(
      "robot.toml", "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\nmoter = \"x\"\n");
  const auto result = EmulatorProcess({"--config", file}).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err,
            "lk-emu: " + file + ":5: bus.drive.moter: unknown key, did you mean motor?\n");
}

TEST(Cli, CheckRejectsWhatARunRejects) {
  const test::TempDirectory own;
  const std::string file =
      own.put("robot.toml", "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 0\n");
  const auto result = EmulatorProcess({"--config", file, "--check"}).wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "lk-emu: " + file + ":4: bus.drive.id: 0 is out of range (1 to 32)\n");
}

TEST(Cli, CheckPrintsTheConfigurationOnly) {
  const test::TempDirectory own;
  const std::string file = own.put("robot.toml", R"(bitrate = 500000
[[bus]]
interface = "nowhere0"
[[bus.drive]]
id = 3
motor = "mg4005"
generation = "v236"
quirks = { pid_commands = true, state_1 = "decivolt" }
boot_angle_deg = 12.5
load = { J_g_cm2 = 100, tau_gravity_Nm = 0.5, theta_min_deg = -10, theta_max_deg = 20 }
rom.endurance_writes = 9
settings = { acceleration_dps_s = 100, max_angle_deg = 90, encoder_offset = 7, protection.stall.enabled = true }
profile.brake = { tau_mNm = 300, engage_ms = 10, release_ms = 10 }
profile.supply.v_source_V = 12
[[bus.drive]]
id = 12
motor = "ms3506"
quirks = { encoder_span = "output_turn", multi_drive_more = true }
settings = { broadcast_mode = true, protection.motor_temperature.enabled = false }
[[bus.event]]
at_s = 1
id = 3
sag_to_V = 5
sag_s = 1
)");
  const auto result = EmulatorProcess({"--config", file, "--check"}).wait();
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(
      result.out,
      R"(nowhere0: 500 kbit/s, 2 drives, 1 event, seed 1
)"
      R"(  id  motor   series  generation    gear  encoder    supply       current  speed  accel.)"
      R"(  angle    zero   boot  ROM     ROM  events  load
)"
      R"(                                          bits            V      or power    dps   dps/s)"
      R"(    deg  counts    deg   ms  writes
)"
      R"(   3  mg4005  MG      v236 mixed      10  16 output      12      1000 LSB  16800     100)"
      R"(     90       7   12.5    2       9       1  100 g cm2, gravity 0.5 Nm, stops -10..20 deg
)"
      R"(  12  ms3506  MS      legacy mixed     1  16             12  850 permille  16800       -)"
      R"(      -       0  drawn    2   10000       -  -

note: nowhere0 drive 3: supply of 12 V, the vendor says 24 to 48 V
note: nowhere0 drive 3: answers 0x30 and 0xC0; no known drive does both
note: nowhere0 drive 3: unlike v236: state_1 = "decivolt", pid_commands = true
note: nowhere0 drive 3: brake of 300 mNm
note: nowhere0 drive 3: protections on: stall
note: nowhere0 drive 12: multi-drive mode, and 0x280 has no slot for this ID
note: nowhere0 drive 12: unlike legacy: multi_drive_more = true, encoder_span = "output_turn"
note: nowhere0 drive 12: protections off: motor_temperature
)");
}

/// Returns the first line of the drive table that --check prints.
std::string checked_drive(const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"--check", "--bus", "nowhere0", "--ids", "1"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const auto result = EmulatorProcess(arguments).wait();
  EXPECT_EQ(result.status, 0) << result.err;
  const std::size_t drive = result.out.find("\n   1  ");
  return drive == std::string::npos ? result.out : result.out.substr(drive + 7, 12);
}

TEST(Cli, AcceptsMotorNamesAndFiles) {
  EXPECT_EQ(checked_drive({"--motor", "MF7015-10T"}), "mf7015  MF  ");
  EXPECT_EQ(checked_drive({"--motor", "MG4005"}), "mg4005  MG  ");
  EXPECT_EQ(checked_drive({"--motor", "mg4005-i10"}), "mg4005  MG  ");
  const test::TempDirectory own;
  const std::string file = own.put("my.toml", "extends = \"MG4005\"\nmechanics.J_g_cm2 = 150\n");
  EXPECT_EQ(checked_drive({"--motor", file}), "my.toml  MG ");
  const auto shown = EmulatorProcess({"motors", file}).wait();
  EXPECT_EQ(shown.err, "");
  EXPECT_NE(shown.out.find("  file " + file + "\n  extends "), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("motors/mg4005.toml\n"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("150 g cm2"), std::string::npos) << shown.out;
}

/// Each label has its own gear, turn of the encoder field, and bits.
TEST(Motors, LabelsDecideAboutGearAndEncoder) {
  struct Label {
    const char* label;
    const char* motor;
    const char* gear;
    const char* legacy;
    const char* v236;
  };
  for (const Label& label : {
           Label{"MG4005E-i10", "mg4005", "10", "16 output", "16 output"},
           {"MG4005-i10", "mg4005", "10", "16 rotor", "16 rotor"},
           {"MG4010E-i10", "mg4010", "10", "16 output", "16 output"},
           {"MG4010-i10", "mg4010", "10", "16 rotor", "16 rotor"},
           {"MG4010E-i36", "mg4010-i36", "36", "16 output", "16 output"},
           {"MG5010E-i10", "mg5010", "10", "16 output", "16 output"},
           {"MG5010-i10", "mg5010", "10", "16 rotor", "16 rotor"},
           {"MG5010E-i36v3", "mg5010-i36", "36", "16 output", "16 output"},
           {"MG6012E-i8", "mg6012-i8", "8", "16 output", "16 output"},
           {"MG6012-i8", "mg6012-i8", "8", "16 rotor", "16 rotor"},
           {"MG6012E-i36", "mg6012-i36", "36", "16 output", "16 output"},
           {"MG8010E-i36", "mg8010-i36", "36", "16 output", "16 output"},
           {"MG8016E", "mg8016", "6", "16 output", "16 output"},
           {"MG8016-i6", "mg8016", "6", "16 rotor", "16 rotor"},
           {"MF4015", "mf4015", "1", "14", "16"},
           {"MF7015-10T", "mf7015", "1", "14", "16"},
           {"MF7015v2-10T", "mf7015", "1", "16", "16"},
           {"MF9015", "mf9015", "1", "14", "16"},
           {"MF9015v2-35T", "mf9015", "1", "16", "16"},
           {"MF9025-16T", "mf9025", "1", "14", "16"},
           {"MF9025v2", "mf9025", "1", "16", "16"},
           {"MF9025-35T", "mf9025-35t", "1", "14", "16"},
           {"MHF7015", "mhf7015", "1", "16", "16"},
           {"MHF9025", "mh9025", "1", "14", "14"},
           {"RMD-L-7015", "mf7015-23t", "1", "14", "16"},
           {"RMD-L-7025", "mf7015", "1", "14", "16"},
           {"RMD-X8", "rmd-x8", "6", "16 rotor", "16 rotor"},
           {"RMD-X8-PRO", "rmd-x8-pro", "9", "16 rotor", "16 rotor"},
       }) {
    for (const auto& [generation, encoder] :
         {std::pair{"legacy", label.legacy}, {"v236", label.v236}}) {
      const auto result = EmulatorProcess({"--check", "--bus", "a", "--ids", "1", "--motor",
                                           label.label, "--generation", generation})
                              .wait();
      EXPECT_EQ(result.err, "") << label.label;
      const std::size_t begin = result.out.find("\n   1  ") + 7;
      std::istringstream row(result.out.substr(begin, result.out.find('\n', begin) - begin));
      std::string motor, series, name, gear, bits, turn;
      row >> motor >> series >> name >> gear >> bits >> turn;
      EXPECT_EQ(motor, label.motor) << result.out;
      EXPECT_EQ(name, generation) << result.out;
      EXPECT_EQ(gear, label.gear) << result.out;
      EXPECT_EQ(gear == "1" ? bits : bits + " " + turn, encoder) << label.label << generation;
    }
  }
}

TEST(Motors, LabelsMatchTheDocument) {
  std::ostringstream page;
  page << std::ifstream(LKEMU_SOURCE_DIR "/docs/start/which-drive.md").rdbuf();
  const std::string table = EmulatorProcess({"motors", "--labels"}).wait().out;
  EXPECT_NE(page.str().find("<!-- begin labels -->\n" + table + "<!-- end labels -->"),
            std::string::npos)
      << "put what `lk-emu motors --labels` prints between the markers";
}

TEST(Cli, ErrorsOfAMotorFileNameThatFile) {
  const test::TempDirectory own;
  const std::string motor = own.put("my.toml", "extends = \"mf7015\"\n[motor]\npole_pairs = 0\n");
  const std::string robot = own.put("robot.toml",
                                    "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n"
                                    "motor = \"./my.toml\"\n");
  const auto result = EmulatorProcess({"--check", "--config", robot}).wait();
  EXPECT_EQ(result.err, "lk-emu: " + motor + ":3: motor.pole_pairs: 0 is out of range (1 to 64)\n");
}

/// Names select shipped files, but a local file of that name has priority.
TEST(Cli, FindsShippedFilesByName) {
  const auto robot = EmulatorProcess({"--check", "--config", "quadruped"}).wait();
  EXPECT_EQ(robot.status, 0) << robot.err;
  EXPECT_NE(robot.out.find("mg8016"), std::string::npos) << robot.out;
  const auto run = EmulatorProcess({"run", "jammed_joint"}).wait();
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("jammed_joint"), std::string::npos) << run.out;
  const auto check =
      EmulatorProcess({"--check", "--config", "gimbal", "--scenario", "jammed_joint"}).wait();
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_NE(check.err.find("scenario jammed_joint: "), std::string::npos) << check.err;
  const test::TempDirectory own;
  own.put("quadruped", "[[bus]]\n");
  const auto here =
      EmulatorProcess({"--check", "--config", "quadruped"},
                      {"sh", "-c", "cd '" + own.path().string() + "' && exec \"$@\"", "sh"})
          .wait();
  EXPECT_EQ(here.err, "lk-emu: quadruped:1: bus.interface: missing\n");
}

TEST(Cli, CheckAcceptsLocalhost) {
  const auto result =
      EmulatorProcess({"--check", "--bus", "nowhere0", "--ids", "1", "--http", "localhost:8474"})
          .wait();
  EXPECT_EQ(result.status, 0) << result.err;
}

TEST(Cli, CheckNeedsNoFile) {
  const auto result = EmulatorProcess({"--bus", "nowhere0", "--ids", "1-12", "--check"}).wait();
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.out.rfind("nowhere0: 1 Mbit/s, 12 drives, 0 events, seed 1\n", 0), 0U);
}

TEST(Cli, GenerationAndQuirksApplyToThePrecedingBus) {
  const auto result = EmulatorProcess({"--check", "--motor", "mg4010", "--generation", "seen",
                                       "--bus", "a", "--ids", "1", "--bus", "b", "--ids", "2",
                                       "--generation", "v236", "--quirk", "pid_commands=true"})
                          .wait();
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.out.find("   1  mg4010  MG      late-legacy "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("   2  mg4010  MG      v236 mixed "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("note: b drive 2: unlike v236: pid_commands = true\n"),
            std::string::npos)
      << result.out;
  EXPECT_EQ(result.out.find("unlike late-legacy"), std::string::npos) << result.out;
}

TEST(Cli, MotorsListsObservedGenerations) {
  const std::string list = EmulatorProcess({"motors"}).wait().out;
  const auto line_of = [&list](const std::string& motor) {
    const std::size_t begin = list.find('\n' + motor + ' ') + 1;
    return list.substr(begin, list.find('\n', begin) - begin);
  };
  const auto says = [&](const char* motor, const char* seen) {
    return (line_of(motor) + ' ').find(" bit  " + std::string(seen) + ' ') != std::string::npos;
  };
  EXPECT_TRUE(says("mg4010", "late-legacy")) << list;
  EXPECT_TRUE(says("mg6010", "v236")) << list;
  EXPECT_TRUE(says("ms3506", "-")) << list;
}

TEST(Cli, WarnsThatTheScenarioRobotIsUnused) {
  const std::string scenarios = LKEMU_SOURCE_DIR "/configs/scenarios/";
  const auto result =
      EmulatorProcess({"--check", "--bus", "nowhere0", "--config", scenarios + "robots/joint.toml",
                       "--scenario", scenarios + "jammed_joint.toml"})
          .wait();
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.err.find("scenario jammed_joint: its robot robots/joint.toml is not used"),
            std::string::npos)
      << result.err;
  EXPECT_EQ(result.err.find('\n'), result.err.size() - 1) << result.err;
  const auto other = EmulatorProcess({"--check", "--bus", "nowhere0", "--ids", "1", "--scenario",
                                      scenarios + "jammed_joint.toml"})
                         .wait();
  EXPECT_NE(other.err.find("; its drive 1 on nowhere0 is mg8016, here it is mf7015"),
            std::string::npos)
      << other.err;
}

TEST(Cli, PrintsVersionAndHelp) {
  const auto version = EmulatorProcess({"--version"}).wait();
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out, "lk-emu " LKEMU_VERSION "\n");
  const auto help = EmulatorProcess({"--help"}).wait();
  EXPECT_EQ(help.status, 0);
  for (const char* option :
       {"--bus", "--ids", "--motor", "--generation", "--quirk", "--config", "--seed", "--bitrate",
        "--create-bus", "--check", "--rom", "--wipe-rom", "--log-level", "--version"}) {
    EXPECT_NE(help.out.find(option), std::string::npos) << option;
  }
}

/// An upgrade removes the running program and replaces its files.
TEST(Motors, AreFoundAfterAnUpgrade) {
  const test::TempDirectory own;
  std::filesystem::create_directories(own.path() / "bin");
  std::filesystem::create_directories(own.path() / "share");
  std::filesystem::create_directory_symlink(LKEMU_SOURCE_DIR "/configs",
                                            own.path() / "share/lk-emu");
  const std::string program = own.path("bin/lk-emu");
  // $1 is the program; a copy of it runs instead, and is deleted by then.
  EmulatorProcess emulator({"--check", "--bus", "vcan0", "--ids", "1", "--motor", "mf7015"},
                           {"sh", "-c",
                            "cp \"$1\" " + program + " && exec 3<" + program + " && rm " + program +
                                " && shift && exec /proc/self/fd/3 \"$@\"",
                            "sh"});
  const auto result = emulator.wait();
  EXPECT_EQ(result.status, 0) << result.err;
}

/// A robot without a battery-backed clock starts in 1970; 56 years take long to emulate.
TEST(Log, RejectsClockJumpsWithTheirLine) {
  const test::TempDirectory own;
  const std::string log = own.put("robot.log",
                                  "(0012.000000) can0 141#9C00000000000000\n"
                                  "\n"
                                  "(3612.000000) can0 141#9C00000000000000\n"
                                  "(1790000000.000000) can0 141#9C00000000000000\n");
  const std::string robot = LKEMU_SOURCE_DIR "/configs/buses/gimbal.toml";
  const auto result = EmulatorProcess({"replay", "--log", log, "--config", robot}).wait();
  EXPECT_EQ(result.status, 2);
  // 1790000000 − 3612; the hour before it is within the limit.
  EXPECT_EQ(result.err, "lk-emu: replay: " + log +
                            ":4: comes 1789996388 s after the frame before it, and no silence may "
                            "be longer than an hour: if the clock was set, cut the log there\n");
}

TEST(EndWithStdin, RequiresAPipe) {
  expect_refused(
      EmulatorProcess({"--bus", own_bus(), "--ids", "1", "--rom", ":memory:", "--end-with-stdin"},
                      {"sh", "-c", "exec \"$@\" </dev/null", "sh"}),
      "lk-emu: --end-with-stdin: standard input is not a pipe; start lk-emu with one\n");
}

}  // namespace cli_test
}  // namespace lk::host

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <regex>
#include <sstream>

#include "emulator/config/config.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/core/generation.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_profile_test {

const std::filesystem::path kMotors = std::filesystem::path(LKEMU_SOURCE_DIR) / "configs/motors";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

MotorFile shipped_file(const std::string& name) {
  const auto file = kMotors / (name + ".toml");
  return {name, file.string(), text_of(file)};
}

Profile shipped(const std::string& name) { return parse_profile(shipped_file(name), shipped_file); }

std::vector<std::string> shipped_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kMotors)) {
    names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

TEST(ConfigProfile, AcceptsTheExampleWithEveryKey) {
  const auto file = kMotors.parent_path() / "buses/example.toml";
  const auto buses = parse_config(text_of(file), file.string(), {}, shipped);
  ASSERT_EQ(buses.size(), 3U);
  EXPECT_EQ(buses[0].servos[0].rom.max_torque_current_lsb, 600);
  EXPECT_EQ(buses[0].servos[0].quirks, Quirks{}) << "it shows the values of legacy";
  EXPECT_EQ(buses[0].servos[2].rom.max_power_permille, 600);
  EXPECT_FALSE(buses[0].events.empty());
  EXPECT_EQ(buses[1].servos.size(), 3U);
  EXPECT_EQ(buses[2].serial, [] {
    SerialConfig defaults;
    defaults.broadcast_reply_time = std::chrono::microseconds(45);  // the one for 2 Mbit/s
    return defaults;
  }());
  EXPECT_EQ(buses[2].servos[0].quirks, quirks_of(Generation::kV235, protocol::Framing::kSerial))
      << "it shows the values of v235";
}

class ShippedMotor : public testing::TestWithParam<std::string> {};

TEST_P(ShippedMotor, Parses) {
  const Profile profile = shipped(GetParam());
  EXPECT_EQ(profile.name, GetParam());
  EXPECT_FALSE(profile.model.empty());
}

TEST_P(ShippedMotor, EveryNumberHasAQualityLetter) {
  const std::regex value(R"(^[A-Za-z_0-9]+ = .*)");
  const std::regex lettered(R"(^[^#]+# [SEDGHh](:|;|$).*)");
  std::istringstream lines(text_of(kMotors / (GetParam() + ".toml")));
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, value)) continue;
    EXPECT_TRUE(std::regex_match(line, lettered)) << line;
  }
}

TEST_P(ShippedMotor, EncoderFitsItsSeries) {
  const Profile profile = shipped(GetParam());
  const int bits = profile.drive.encoder.bits;
  switch (profile.series) {
    case Series::kMs:
      EXPECT_TRUE(bits == 12 || bits == 18);
      break;
    case Series::kMf:
      EXPECT_TRUE(bits == 14 || bits == 18);
      break;
    case Series::kMg:
      EXPECT_EQ(bits, 18);
      break;
    case Series::kMh:
      EXPECT_EQ(bits, 14);
      break;
  }
  EXPECT_EQ(profile.drive.control.has_current_loop, profile.series != Series::kMs);
  EXPECT_EQ(profile.drive.mechanics.gear_ratio > 1, profile.series == Series::kMg);
}

TEST_P(ShippedMotor, IronIsAPartOfItsFriction) {
  const model::MechanicsParams m = shipped(GetParam()).drive.mechanics;
  for (const double share : {m.hysteresis_share, m.eddy_share}) {
    EXPECT_GT(share, 0);
    EXPECT_LT(share, 1);
  }
}

TEST_P(ShippedMotor, SupplyFitsItsSeriesAndItsProtections) {
  const Profile profile = shipped(GetParam());
  const Rating& rating = profile.rating;
  EXPECT_GE(profile.drive.supply.v_source, rating.voltage_min_V);
  EXPECT_LE(profile.drive.supply.v_source, rating.voltage_max_V);
  // The drive runs over the whole supply range, and voltage errors can be cleared.
  const auto& under = profile.factory.protections[0];
  const auto& over = profile.factory.protections[1];
  EXPECT_LT(under.threshold + under.hysteresis, rating.voltage_min_V);
  EXPECT_GT(over.threshold - over.hysteresis, rating.voltage_max_V);
  // Under-voltage is reported before the controller resets.
  const model::LogicParams& logic = profile.drive.logic;
  EXPECT_LT(logic.v_reset + logic.v_reset_hysteresis, under.threshold);
}

TEST_P(ShippedMotor, ProtectionsAreWithinSensorRange) {
  const Profile profile = shipped(GetParam());
  const auto& all = profile.factory.protections;
  const auto of = [&](model::Error kind) { return all[static_cast<std::size_t>(kind)]; };
  EXPECT_LT(of(model::Error::kOverCurrent).threshold, of(model::Error::kShort).threshold);
  EXPECT_LT(of(model::Error::kShort).threshold, profile.drive.current_sensor.range);
  EXPECT_FALSE(of(model::Error::kShort).recoverable);
  for (const auto kind : {model::Error::kUnderVoltage, model::Error::kMotorTemperature}) {
    EXPECT_TRUE(of(kind).enabled) << "legacy firmware has these two";
    EXPECT_TRUE(of(kind).recoverable);
  }
}

INSTANTIATE_TEST_SUITE_P(Config, ShippedMotor, testing::ValuesIn(shipped_names()),
                         [](const auto& motor) {
                           return std::regex_replace(motor.param, std::regex("-"), "_");
                         });

TEST(ConfigProfile, ConvertsUnits) {
  const Profile profile = shipped("mg4005");
  EXPECT_EQ(profile.series, Series::kMg);
  EXPECT_EQ(profile.encoder_span, EncoderSpan::kOutputTurn);
  EXPECT_DOUBLE_EQ(profile.drive.motor.L_d, 0.25e-3);
  EXPECT_DOUBLE_EQ(profile.drive.mechanics.J, 140e-7);
  EXPECT_DOUBLE_EQ(profile.drive.inverter.f_pwm, 32e3);
  EXPECT_NEAR(profile.drive.mechanics.backlash_out, 10.0 / 60 * std::numbers::pi / 180, 1e-12);
  EXPECT_DOUBLE_EQ(profile.drive.supply.C_link, 470e-6);
  const auto& under_voltage = profile.factory.protections[0];
  EXPECT_TRUE(under_voltage.enabled);
  EXPECT_DOUBLE_EQ(under_voltage.threshold, 7.0);
}

TEST(ConfigProfile, Mg4005FrictionMatchesTheMeasurement) {
  const Profile profile = shipped("mg4005");
  const double k_t = 1.5 * profile.drive.motor.pole_pairs * profile.drive.motor.psi_f;
  const double lsb_A = profile.drive.mechanics.tau_coulomb / k_t * 4096 / 66;
  EXPECT_NEAR(lsb_A, 12.4, 0.05);
}

/// A motor file copied from version 0.1.0 keeps its values.
TEST(ConfigProfile, ReadsMotorFilesOfEarlierVersions) {
  const Profile old = parse_profile(
      text_of(LKEMU_SOURCE_DIR "/tests/emulator/fixtures/0.1.0/recording/motors/mg4005.toml"),
      "m.toml", "m");
  EXPECT_EQ(old.drive.control.estimator_bandwidth, 2000);
  EXPECT_EQ(old.drive.control.report_bandwidth, 300);
  EXPECT_EQ(old.factory.current_ramp_A_s, 25);
  EXPECT_EQ(old.drive.slow_sensor.board_share, 0);
  EXPECT_EQ(old.drive.mechanics.hysteresis_share, 0);
  EXPECT_EQ(old.drive.mechanics.eddy_share, 0);
}

TEST(ConfigProfile, ErrorsNameFileLineKeyAndReason) {
  const std::string good = text_of(kMotors / "mf7015.toml");
  const auto spoilt = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    return std::regex_replace(config_error([&] { parse_profile(text, "m.toml", "m"); }),
                              std::regex(R"(^m\.toml:\d+: )"), "");
  };
  EXPECT_EQ(spoilt("pole_pairs = 14", "pole_pairs = 0"),
            "motor.pole_pairs: 0 is out of range (1 to 64)");
  EXPECT_EQ(spoilt("pole_pairs = 14", "pole_pair = 14"),
            "motor.pole_pair: unknown key, did you mean pole_pairs?");
  EXPECT_EQ(spoilt("pole_pairs = 14", "#"), "motor.pole_pairs: missing");
  EXPECT_EQ(spoilt("pole_pairs = 14", "pole_pairs = 14.5"),
            "motor.pole_pairs: must be a whole number");
  EXPECT_EQ(spoilt("R_s_ohm = 0.14", "R_s_ohm = inf"),
            "motor.R_s_ohm: inf is out of range (0.001 to 100)");
  EXPECT_EQ(spoilt("[thermal]", "[thermic]"), "thermic: unknown key, did you mean thermal?");
  EXPECT_EQ(spoilt("series = \"MF\"", "series = \"MX\""),
            "series: \"MX\" is not one of MS, MF, MG, MH");
  EXPECT_EQ(spoilt("tau_coulomb_mNm = ", "tau_coulomb_mNm = 9"),
            "mechanics.tau_static_mNm: must not be below tau_coulomb_mNm");
  EXPECT_EQ(spoilt("max_torque_current_lsb = 1300", "max_torque_current_lsb = 2048"),
            "factory.max_torque_current_lsb: 2048 is out of range (0 to 2000)");
  EXPECT_EQ(spoilt("max_torque_current_lsb = 1300", "max_power_permille = 850"),
            "factory.max_power_permille: for MS drives only; use max_torque_current_lsb");
  EXPECT_EQ(spoilt("series = \"MF\"", "series = \"MS\""),
            "factory.max_torque_current_lsb: not for MS drives; use max_power_permille");
  EXPECT_EQ(spoilt("reset_V = 6.0", "reset_V = 6.5"),
            "factory.protection.under_voltage.threshold_V: must be above logic.reset_V + "
            "logic.reset_hysteresis_V");
  EXPECT_EQ(spoilt("has_current_loop = true", "has_current_loop = false"),
            "control.has_current_loop: must be true: only MS drives have no current loop");
  EXPECT_EQ(spoilt("encoder_offset = 0", "encoder_offset = 65535"),
            "factory.encoder_offset: does not fit the encoder of this motor (" +
                std::to_string(std::min(shipped("mf7015").drive.encoder.bits, 16)) +
                " bit on the wire)");
  EXPECT_EQ(spoilt("hysteresis_share = 0", "hysteresis_share = 1"),
            "iron.hysteresis_share: 1.9 is out of range (0 to 1)");
  EXPECT_EQ(spoilt("eddy_share = 0.9", "eddy_share = -0.1"),
            "iron.eddy_share: -0.1 is out of range (0 to 1)");
  EXPECT_EQ(spoilt("boot_time_ms", "#"), "logic.boot_time_ms: missing");
  EXPECT_EQ(spoilt("i_logic_mA", "#"), "supply.i_logic_mA: missing");
  EXPECT_EQ(spoilt("delay_s = 0, recoverable = true", "delay_s = 0"),
            "factory.protection.stall.recoverable: missing");
  EXPECT_EQ(spoilt("voltage_min_V = 12", "voltage_min_V = 40"),
            "rating.voltage_min_V: must not be above voltage_max_V");
  EXPECT_EQ(spoilt("over_voltage = { enabled = false, threshold_V = 60.0",
                   "over_voltage = { enabled = true, threshold_V = 7.0"),
            "factory.protection.over_voltage.threshold_V: over-voltage at 7 V must be above "
            "under-voltage at 7 V: one of them would always be there");
  EXPECT_EQ(spoilt("gear_stiffness_Nm_rad = 0", "gear_stiffness_Nm_rad = 500"),
            "mechanics.J_out_g_cm2: J_out_g_cm2 must be above 0, for a springy gear moves it; or "
            "make the gear rigid, gear_stiffness_Nm_rad = 0");
  EXPECT_EQ(spoilt("model = ", "# "), "model: missing");
  EXPECT_EQ(spoilt(good.substr(good.find("[factory.protection]")), ""),
            "factory.protection: missing");
  EXPECT_EQ(spoilt("[thermal]", "[brake]\ntau_mNm = 500\n[thermal]"), "brake.engage_ms: missing");
}

// --- files that extend others

/// Motor files in memory by path, and the shipped ones by name.
class Extending : public testing::Test {
 protected:
  Profile load(const std::string& motor) const {
    const FindMotorFile find = [this](const std::string& wanted) { return find_file(wanted); };
    return parse_profile(find(motor), find);
  }
  MotorFile find_file(const std::string& motor) const {
    const auto found = files_.find(motor);
    if (found != files_.end()) return {motor, motor, found->second};
    const auto shipped = kMotors / (motor + ".toml");
    if (!std::filesystem::exists(shipped)) throw UnknownMotor("no motor \"" + motor + "\"");
    return {motor, shipped.string(), text_of(shipped)};
  }
  std::string error(const std::string& text) {
    files_["my.toml"] = text;
    return config_error([&] { load("my.toml"); });
  }

  std::map<std::string, std::string> files_;
};

TEST_F(Extending, OverridesOnlyTheGivenKeys) {
  files_["my.toml"] = R"(extends = "mf7015"
model = "the one in the lab"
[motor]
pole_pairs = 21
[factory.protection]
stall = { enabled = true }
)";
  const Profile base = shipped("mf7015");
  const Profile mine = load("my.toml");
  EXPECT_EQ(mine.name, "my.toml");
  EXPECT_EQ(mine.model, "the one in the lab");
  EXPECT_EQ(mine.aliases, std::vector<std::string>{}) << "it is not what the other is sold as";
  EXPECT_EQ(mine.rating.torque_rated_Nm, 0) << "printed of the other";
  EXPECT_GT(base.rating.torque_rated_Nm, 0);
  EXPECT_EQ(mine.seen_generation, std::nullopt) << "seen of the other";
  EXPECT_NE(base.seen_generation, std::nullopt);
  EXPECT_EQ(mine.files, (std::vector<std::string>{"my.toml", (kMotors / "mf7015.toml").string()}));
  EXPECT_EQ(mine.drive.motor.pole_pairs, 21);
  EXPECT_EQ(mine.drive.motor.R_s, base.drive.motor.R_s);
  EXPECT_EQ(mine.series, base.series);
  const auto& stall = mine.factory.protections[6];
  EXPECT_TRUE(stall.enabled);
  EXPECT_EQ(stall.threshold, base.factory.protections[6].threshold);
}

/// With its own friction, the iron takes an equal share of it.
TEST_F(Extending, KeepsTheIronShareOfFriction) {
  files_["my.toml"] = "extends = \"mg4005\"\n[mechanics]\ntau_coulomb_mNm = 5\nB_uNm_s_rad = 4\n";
  const model::MechanicsParams m = load("my.toml").drive.mechanics;
  EXPECT_DOUBLE_EQ(m.tau_coulomb * m.hysteresis_share, 0.5 * 5e-3);
  EXPECT_DOUBLE_EQ(m.B * m.eddy_share, 0.5 * 4e-6);
}

TEST_F(Extending, DocumentExampleWorks) {
  const std::string document =
      text_of(std::filesystem::path(LKEMU_SOURCE_DIR) / "docs/reference/configuration.md");
  const std::size_t begin = document.find("# my.toml\n");
  ASSERT_NE(begin, std::string::npos);
  files_["my.toml"] = document.substr(begin, document.find("```", begin) - begin);
  files_["MG4010-i10"] = text_of(kMotors / "mg4010.toml");
  const Profile mine = load("my.toml");
  EXPECT_EQ(mine.model, "MG4010 with a 36:1 gear");
  EXPECT_DOUBLE_EQ(mine.drive.mechanics.gear_ratio, 36);
  EXPECT_DOUBLE_EQ(mine.rating.torque_rated_Nm, 9);
  EXPECT_DOUBLE_EQ(mine.factory.max_speed_dps, 20'000);
  EXPECT_EQ(mine.drive.motor.R_s, shipped("mg4010").drive.motor.R_s);
}

TEST_F(Extending, ResolvesPathsFromTheExtendingFile) {
  files_["robot/left.toml"] = "extends = \"../lab/my.toml\"\nmotor.R_s_ohm = 0.2\n";
  files_["robot/../lab/my.toml"] =
      "extends = \"./base.toml\"\nmotor.R_s_ohm = 0.3\nmotor.L_d_mH = 0.5\n";
  files_["robot/../lab/base.toml"] = "extends = \"mf7015\"\nmotor.L_q_mH = 0.5\n";
  const Profile left = load("robot/left.toml");
  EXPECT_DOUBLE_EQ(left.drive.motor.R_s, 0.2);
  EXPECT_DOUBLE_EQ(left.drive.motor.L_d, 0.5e-3);
  EXPECT_DOUBLE_EQ(left.drive.motor.L_q, 0.5e-3);
  EXPECT_EQ(left.files.size(), 4U);
}

TEST_F(Extending, AcceptsIncompleteBaseFiles) {
  files_["common.toml"] = "encoder_span = \"output_turn\"\n";
  std::string rest = text_of(kMotors / "mf7015.toml");
  const std::size_t span = rest.find("encoder_span");
  rest.erase(span, rest.find('\n', span) - span);
  files_["my.toml"] = "extends = \"common.toml\"\n" + rest;
  EXPECT_EQ(load("my.toml").encoder_span, EncoderSpan::kOutputTurn);
  EXPECT_EQ(error("extends = \"common.toml\"\n"), "my.toml:1: model: missing");
}

TEST_F(Extending, ErrorsNameFileAndLine) {
  files_["base.toml"] = "extends = \"mf7015\"\n\nmotor.pole_pairs = 0\n";
  EXPECT_EQ(error("extends = \"base.toml\"\n"),
            "base.toml:3: motor.pole_pairs: 0 is out of range (1 to 64)");
  files_["base.toml"] = "extends = \"mf7015\"\n\nmotor.pole_pair = 7\n";
  EXPECT_EQ(error("extends = \"base.toml\"\n"),
            "base.toml:3: motor.pole_pair: unknown key, did you mean pole_pairs?");
  EXPECT_EQ(error("extends = \"mf7015\"\nmotor = 7\n"), "my.toml:2: motor: must be a table");
  EXPECT_EQ(error("extends = \"mf7015\"\n\n[mechanics]\ntau_coulomb_mNm = 20\n"),
            "my.toml:4: mechanics.tau_static_mNm: must not be below tau_coulomb_mNm")
      << "what the other file says is right by itself";
  EXPECT_EQ(error("extends = \"mf7015\"\nrating = { voltage_min_V = 7, voltage_max_V = 5 }\n"),
            "my.toml:2: rating.voltage_min_V: must not be above voltage_max_V");
  EXPECT_EQ(error("extends = \"mf7015\"\nseries = \"MS\"\n"),
            "my.toml:2: series: differs from the motor that it extends: MF");
  EXPECT_EQ(error("extends = \"mf7015\"\n[brake]\ntau_mNm = 5\n"),
            "my.toml:2: brake.engage_ms: missing");
}

TEST_F(Extending, RejectsInvalidBaseWithItsLine) {
  EXPECT_EQ(error("\nextends = \"mf7105\"\n"), "my.toml:2: extends: no motor \"mf7105\"");
  EXPECT_EQ(error("extends = 7\n"), "my.toml:1: extends: must be a string");
  EXPECT_EQ(error("extends = \"my.toml\"\n"), "my.toml:1: extends: my.toml extends itself");
  files_["./my.toml"] = "";
  files_["other.toml"] = "\nextends = \"./my.toml\"\n";
  EXPECT_EQ(error("extends = \"other.toml\"\n"), "other.toml:2: extends: my.toml extends itself");
  for (int n = 0; n < 9; ++n) {
    files_[std::to_string(n) + ".toml"] = "extends = \"" + std::to_string(n + 1) + ".toml\"\n";
  }
  files_["9.toml"] = "";
  // my.toml is the first of eight files, 6.toml the last.
  EXPECT_EQ(error("extends = \"0.toml\"\n"),
            "6.toml:1: extends: more than 8 motor files, each extending the next, or a loop of "
            "them");
  EXPECT_EQ(config_error([] { parse_profile("extends = \"mf7015\"", "m.toml", "m"); }),
            "m.toml:1: extends: not possible here: no other motor files are available");
}

// --- names

TEST(MotorNames, AreUnique) {
  std::map<std::string, std::string> taken;  // lower case to motor
  for (const auto& entry : std::filesystem::directory_iterator(kMotors)) {
    const std::string name = entry.path().stem().string();
    std::vector<std::string> all = motor_labels(text_of(entry.path()), entry.path().string());
    all.push_back(name);
    for (std::string label : all) {
      std::ranges::transform(label, label.begin(),
                             [](char c) { return static_cast<char>(std::tolower(c)); });
      const auto [other, is_new] = taken.emplace(label, name);
      EXPECT_EQ(other->second, name) << label;
      EXPECT_FALSE(is_path(label)) << label;
    }
  }
  EXPECT_EQ(taken.at("mf7015-10t"), "mf7015");
}

TEST(MotorNames, ResolvePathsFromTheFile) {
  EXPECT_EQ(motor_of("robot.toml", "./my.toml"), "./my.toml");
  EXPECT_EQ(motor_of("a/robot.toml", "./my.toml"), "a/my.toml");
  EXPECT_EQ(motor_of("a/robot.toml", "../b/my.toml"), "a/../b/my.toml")
      << "a may be a symbolic link, and ../b stand elsewhere";
  EXPECT_EQ(motor_of("a/robot.toml", "../my"), "a/../my");
  EXPECT_EQ(motor_of("./robot.toml", "./my"), "./my") << "still a path, and no name";
  EXPECT_EQ(motor_of("/a/robot.toml", "/b/my.toml"), "/b/my.toml");
  EXPECT_EQ(motor_of("a/robot.toml", "mf7015"), "mf7015");
  EXPECT_EQ(motor_of("a/robot.toml", ""), "");
}

}  // namespace config_profile_test
}  // namespace lk::emulator

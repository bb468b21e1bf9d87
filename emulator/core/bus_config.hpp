#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/adapter_times.hpp"
#include "emulator/core/directive.hpp"
#include "emulator/core/parameter_memory.hpp"
#include "emulator/core/sim_time.hpp"
#include "model/drive_params.hpp"
#include "model/setpoint.hpp"
#include "protocol/frame.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {

using protocol::Series;

class BodySignals;
class Mechanism;

/// Which turn the encoder field of the wire spans on geared motors (docs/protocol.md §7).
enum class EncoderSpan : std::uint8_t { kRotorTurn, kOutputTurn };

/// Where the multi-turn angle starts: from the single-turn angle wrapped to half its circle to
/// either side, or to half a rotor turn, (−180°, 180°]. One and the same where the circle is a
/// rotor turn.
enum class BootWrap : std::uint8_t { kHalfCircle, kHalfTurn };

/// Where the multi-turn angle starts at power-up.
enum class BootMultiTurn : std::uint8_t { kSingleTurn, kZero };
/// What becomes of it at 0x80: as at power-up, or it continues from the single-turn angle.
enum class OffMultiTurn : std::uint8_t { kAsBoot, kSingleTurn };
/// Which flags the reply to 0x9B shows: those left, or those from before.
enum class ClearReply : std::uint8_t { kAfter, kBefore };

/// When an ID or a bit rate that 0x42 has written is in force: from the next start, after 0x44, or
/// at once.
enum class IdChange : std::uint8_t { kRestart, kSave, kWrite };
/// From which ID the reply comes that it is in force after.
enum class IdChangeReply : std::uint8_t { kOld, kNew };
/// What 0x40 shows of a setting that was written and is not in force.
enum class SettingRead : std::uint8_t { kPending, kActive };
/// What becomes of other commands while 0x18 turns the shaft.
enum class CalibrateBusy : std::uint8_t { kSilent, kAnswers };
/// Who is not heard any more after the echo of 0x80, until the drive starts anew: on RS-485 it may
/// hold the line, and no drive is heard.
enum class OffHangs : std::uint8_t { kNo, kDrive, kBus };

/// The rows of protocol::kGenerationRows, in their order.
enum class Generation : std::uint8_t { kLegacy, kLateLegacy, kV235, kV236, kV236b };

/// Misprints of the manual, open points of the protocol, and what sets the generations apart: each
/// its own switch (docs/protocol.md). The values here are those of `legacy`.
struct Quirks {
  bool manual_reply_bytes = false;  // DATA[0] of 0x9B, 0xA7, 0xA8 replies as the manual prints them
  protocol::Dialect dialect;        // what is on the wire
  bool offset_write_takes_effect = true;  // 0x91 is in force at once
  bool run_resumes = true;                // 0x88 after 0x81 resumes the earlier mode
  bool off_needs_run = false;             // 0xA0..0xA8 after 0x80 wait for 0x88
  bool stop_holds = false;                // 0x81 holds the position instead of freeing the shaft
  BootWrap boot_wrap = BootWrap::kHalfCircle;
  BootMultiTurn boot_multi_turn = BootMultiTurn::kSingleTurn;
  OffMultiTurn off_multi_turn = OffMultiTurn::kSingleTurn;
  ClearReply clear_reply = ClearReply::kAfter;
  IdChange id_change = IdChange::kRestart;
  IdChangeReply id_change_reply = IdChangeReply::kOld;
  SettingRead setting_read = SettingRead::kPending;
  CalibrateBusy calibrate_busy = CalibrateBusy::kSilent;
  OffHangs off_hangs = OffHangs::kNo;
  std::optional<EncoderSpan> encoder_span;  // where it is not the motor's

  friend bool operator==(const Quirks&, const Quirks&) = default;
};

/// What the vendor prints, at the output shaft; 0 = not printed.
struct Rating {
  double voltage_min_V = 0;
  double voltage_max_V = 0;
  double torque_rated_Nm = 0;
  double torque_peak_Nm = 0;
  double speed_rated_rpm = 0;
  double speed_no_load_rpm = 0;
};

/// What a drive says it is on RS-485 (0x12). Versions are by 100.
struct Product {
  std::string driver = "DRIVER";  // 20 bytes at most; assumed
  std::string motor;              // the same; empty: the model
  std::array<std::uint8_t, 12> chip_id{};
  std::uint16_t hardware_version = 300;
  std::uint16_t motor_version = 200;
  std::uint16_t firmware_version = 0;  // 0: as the generation's manual
};

/// What a motor file says.
struct Profile {
  std::string name;                  // "mf7015"
  std::string model;                 // "MF7015-10T"
  std::vector<std::string> aliases;  // what else it is sold as
  std::vector<std::string> files;    // its own, and those that it extends
  Series series = Series::kMf;
  Rating rating;
  model::DriveParams drive;
  EncoderSpan encoder_span = EncoderSpan::kRotorTurn;
  std::optional<Generation> seen_generation;  // what such drives were seen to speak
  Registers factory;
  Product product;
};

/// The joint of a body (BusConfig::body) that the output shaft turns: output = rate·(joint −
/// offset).
struct JointLink {
  std::size_t joint = 0;  // of the mechanism's
  double rate = 1;        // turns of the output for one of the joint; below 0: the other way round
  double offset_rad = 0;  // the joint's angle where the output's is 0
  double start_rad = 0;   // the joint's at power-up

  double output_of(double joint_rad) const { return rate * (joint_rad - offset_rad); }
};

/// The joint that a drive turns, as its body has it; 0 without one.
struct JointState {
  double angle_rad = 0;
  double speed_rad_s = 0;
  double torque_Nm = 0;  // on the body, behind what the drive's own inertia takes; of the last step
};

struct ServoConfig {
  int id = 1;      // 1..32: its name; ROM may have it answer at another (Servo::address)
  int dip_id = 0;  // 1..32, what its DIP switch says; 0: `id`
  Profile profile;
  Generation generation = Generation::kLegacy;  // what `quirks` started from
  bool generation_given = false;                // and not the default
  Quirks quirks;
  Registers rom;    // what power-up finds there; profile.factory unless something else is said
  RomWear wear{};   // the writes it has seen
  RomParams flash;  // and what it is made of
  SimTime reply_time = std::chrono::microseconds(100);  // after the query's last bit
  SimTime reply_spread{0};                              // to either side, drawn for each reply
  std::uint8_t rate_code = 4;  // of its bus's bit rate; kAsWired: the bus has none, any will do
  SimTime calibrate_time = std::chrono::seconds(4);  // of 0x18
  // Where the shaft stands at power-up: degrees of the rotor from where the encoder field is 0,
  // whatever the drive makes of them. Drawn from seed and ID when absent.
  std::optional<double> boot_angle_deg;
  // The joint that it turns; it starts where that one is, and the boot angle does not count.
  std::optional<JointLink> joint;
  // Of all of the drive at power-up; that of the air when absent.
  std::optional<double> boot_temperature_C;
  // The zero that the boot angle counts from: the shaft stays where it is when a host moves the
  // zero in ROM. That of `rom` when absent.
  std::optional<std::uint16_t> boot_offset;
};

/// What an RS-485 bus is besides its bit rate (docs/rs485.md).
struct SerialConfig {
  SimTime reply_time = std::chrono::microseconds(150);  // of drives that say nothing else
  SimTime reply_spread = std::chrono::microseconds(50);
  SimTime gap = std::chrono::milliseconds(5);  // inside a packet: it is dropped
  bool scan = true;                            // after a bad header, else the line has to rest
  // A drive takes in a packet that ends before its reply begins, and answers it after that reply.
  bool hears_while_replying = true;
  std::uint8_t max_len = protocol::kMostLen;
  int broadcast_gap_bits = 20;
  // Before each reply to a packet for several; nothing: by the bit rate.
  std::optional<SimTime> broadcast_reply_time;
  bool as_tty = true;         // the terminal starts as a serial port does, not raw
  bool enforces_rate = true;  // a host at another rate is not understood
  bool has_921600 = true;     // among the rate codes of the tool's settings

  friend bool operator==(const SerialConfig&, const SerialConfig&) = default;
};

struct BusConfig {
  std::string interface;  // "vcan0", "rs485:/tmp/arm"
  // bit/s; 0 = frames take no time, and on CAN drives answer at once
  std::int64_t bitrate = 1'000'000;
  // Of the hosts, one of adapter_profiles(); null: none.
  const AdapterProfile* adapter = nullptr;
  std::uint64_t seed = 1;
  std::optional<SerialConfig> serial;  // of RS-485; nothing: CAN
  std::vector<ServoConfig> servos;     // ascending, distinct IDs
  std::vector<TimedDirective> events;  // ascending times; planned when the bus is made
  // What the joints of its drives are of: one for all buses of a robot, which starts from a copy of
  // this; null: none.
  std::shared_ptr<const Mechanism> body;
  // What can be watched of it; null: nothing.
  std::shared_ptr<const BodySignals> body_signals;
  // Inner resistance of the battery that the drives of all buses of a robot have in common, the
  // same on each; 0: each drive has a source for itself.
  double battery_R_ohm = 0;
};

}  // namespace lk::emulator

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/directive.hpp"
#include "emulator/core/host_queue.hpp"
#include "emulator/core/parameter_memory.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire_timing.hpp"
#include "model/drive_params.hpp"
#include "model/setpoint.hpp"
#include "protocol/frame.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {

using protocol::Series;

class BodySignals;
class Mechanism;

/// Turn that the encoder field of the wire spans on geared motors (docs/reference/protocol.md §7).
enum class EncoderSpan : std::uint8_t { kRotorTurn, kOutputTurn };

/// Range in which the multi-turn angle starts, since the turn count is lost. It is ± half of the
/// encoder field's span, or ± half a rotor turn, (−180°, 180°]. Both agree if the field spans a
/// rotor turn.
enum class BootWrap : std::uint8_t { kHalfCircle, kHalfTurn };

/// Multi-turn angle at power-up.
enum class BootMultiTurn : std::uint8_t { kSingleTurn, kZero };
/// Multi-turn angle after 0x80: as at power-up, or from the single-turn angle.
enum class OffMultiTurn : std::uint8_t { kAsBoot, kSingleTurn };
/// Error flags that the reply to 0x9B shows: the flags after the command, or before it.
enum class ClearReply : std::uint8_t { kAfter, kBefore };

/// When an ID or bit rate written by 0x42 takes effect: at the next start, after 0x44, or at once.
enum class IdChange : std::uint8_t { kRestart, kSave, kWrite };
/// ID of the reply to the command that changes the ID.
enum class IdChangeReply : std::uint8_t { kOld, kNew };
/// Value that 0x40 returns for a setting that is written but not in force.
enum class SettingRead : std::uint8_t { kPending, kActive };
/// Reaction to other commands while 0x18 turns the shaft.
enum class CalibrateBusy : std::uint8_t { kSilent, kAnswers };
/// Hang after the echo of 0x80, until a restart. With kDrive the drive sends nothing. With kBus
/// it also holds the RS-485 line: no drive receives anything.
enum class OffHangs : std::uint8_t { kNo, kDrive, kBus };

/// Current loop of the drive's board: it follows its reference within a millisecond, or within tens
/// of milliseconds (docs/internals/model.md §11).
enum class CurrentLoopKind : std::uint8_t { kFast, kSlow };
/// Texture of a drive: that of its motor's type, or of one specimen, drawn from seed and ID.
enum class Specimen : std::uint8_t { kNominal, kDrawn };

/// Values are indices of protocol::kGenerationRows.
enum class Generation : std::uint8_t { kLegacy, kLateLegacy, kV235, kV236, kV236b };

/// Switches for misprints of the manual, open points of the protocol and differences between
/// generations (docs/reference/protocol.md). The defaults are those of `legacy`.
struct Quirks {
  bool manual_reply_bytes = false;  // DATA[0] of 0x9B, 0xA7, 0xA8 replies as the manual prints them
  protocol::Dialect dialect;        // wire format
  bool offset_write_takes_effect = true;  // 0x91 takes effect at once
  bool run_resumes = true;                // 0x88 after 0x81 resumes the earlier mode
  bool off_needs_run = false;             // after 0x80, 0xA0..0xA8 need 0x88 first
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
  std::optional<EncoderSpan> encoder_span;  // overrides Profile::encoder_span
  std::optional<int> encoder_bits;  // differs from the default of motor and generation; the parser
                                    // has put it into Profile::drive
  std::optional<CurrentLoopKind> current_loop;  // absent: by generation and series

  friend bool operator==(const Quirks&, const Quirks&) = default;
};

/// Ratings printed by the vendor, at the output shaft; 0: not printed.
struct Rating {
  double voltage_min_V = 0;
  double voltage_max_V = 0;
  double torque_rated_Nm = 0;
  double torque_peak_Nm = 0;
  double speed_rated_rpm = 0;
  double speed_no_load_rpm = 0;
  double torque_constant_Nm_A = 0;  // at the output; as printed or as hosts have it
};

/// Product data that 0x12 reports on RS-485. Versions are in hundredths.
struct Product {
  std::string driver = "DRIVER";  // at most 20 bytes; assumed
  std::string motor;              // at most 20 bytes; empty: Profile::model
  std::array<std::uint8_t, 12> chip_id{};
  std::uint16_t hardware_version = 300;
  std::uint16_t motor_version = 200;
  std::uint16_t firmware_version = 0;  // 0: version of the generation's manual
};

/// Contents of a motor file.
struct Profile {
  std::string name;                  // "mf7015"
  std::string model;                 // "MF7015-10T"
  std::vector<std::string> aliases;  // other names under which the motor is sold
  std::vector<std::string> files;    // the motor file, and the files that it extends
  Series series = Series::kMf;
  Rating rating;
  model::DriveParams drive;
  EncoderSpan encoder_span = EncoderSpan::kRotorTurn;
  std::optional<Generation> seen_generation;    // generation observed on such drives
  std::optional<CurrentLoopKind> current_loop;  // absent: by generation and series
  bool states_cogging = false;  // the file states the cogging of one motor: no specimens
  bool later_print = false;     // named by a label of drives that show 16 bits
  Registers factory;
  Product product;
};

/// Joint of BusConfig::body that the output shaft turns: output = rate·(joint − offset).
struct JointLink {
  std::size_t joint = 0;  // index in Mechanism::joints()
  double rate = 1;        // turns of the output per turn of the joint; below 0: opposite direction
  double offset_rad = 0;  // joint angle at output angle 0
  double start_rad = 0;   // joint angle at power-up

  double output_of(double joint_rad) const { return rate * (joint_rad - offset_rad); }
};

/// State of the joint that a drive turns; 0 without a joint.
struct JointState {
  double angle_rad = 0;
  double speed_rad_s = 0;
  double torque_Nm = 0;  // mean on the body in the last step, excluding the drive's own inertia
};

struct ServoConfig {
  int id = 1;      // 1..32, as configured; ROM may hold another address (Servo::address)
  int dip_id = 0;  // 1..32, ID on the DIP switch; 0: the switch shows `id`
  Profile profile;
  Generation generation = Generation::kLegacy;  // base of `quirks`
  bool generation_given = false;                // false: `generation` is the default
  Quirks quirks;
  Specimen specimen = Specimen::kNominal;
  Registers rom;    // contents at power-up; default: profile.factory
  RomWear wear{};   // write counts at power-up
  RomParams flash;  // write time and endurance of the ROM
  SimTime reply_time = std::chrono::microseconds(100);  // from the query's last bit to the reply
  SimTime reply_spread{0};                              // RS-485: reply_time varies by ± this
  std::uint8_t rate_code = 4;  // bit rate code of the bus; kAsWired: drives match at any bit rate
  SimTime calibrate_time = std::chrono::seconds(4);  // duration of 0x18
  // Angle of the rotor at power-up, degrees from encoder field 0; does not depend on the dialect.
  // Absent: drawn from seed and ID.
  std::optional<double> boot_angle_deg;
  // Joint that the drive turns, if any. The joint's start angle then replaces the boot angle.
  std::optional<JointLink> joint;
  // Temperature of all parts of the drive at power-up, °C; absent: ambient temperature.
  std::optional<double> boot_temperature_C;
  // Encoder offset on which the boot angle is based. It keeps the shaft in place at power-up after
  // a host has written another offset to ROM. Absent: the offset in `rom`.
  std::optional<std::uint16_t> boot_offset;
};

/// Parameters of an RS-485 bus besides its bit rate (docs/reference/rs485.md).
struct SerialConfig {
  SimTime reply_time = std::chrono::microseconds(150);  // for drives without a reply time
  SimTime reply_spread = std::chrono::microseconds(50);
  SimTime gap = std::chrono::milliseconds(5);  // drives drop a packet with a longer pause
  bool scan = true;  // a drive searches a bad header for the next start; false: it waits for `gap`
  // A drive with a pending reply accepts a packet that ends before this reply begins, and answers
  // it later.
  bool receives_while_replying = true;
  std::uint8_t max_len = protocol::kMaxLen;
  int broadcast_gap_bits = 20;
  // Delay before each reply to a multi-drive packet; absent: by the bit rate.
  std::optional<SimTime> broadcast_reply_time;
  bool as_tty = true;         // the terminal starts with serial port settings, not raw
  bool enforces_rate = true;  // drives do not understand a host at another rate
  bool has_921600 = true;     // the rate codes in the vendor tool's settings include 921600 bit/s

  friend bool operator==(const SerialConfig&, const SerialConfig&) = default;
};

struct BusConfig {
  std::string interface;  // "vcan0", "rs485:/tmp/arm"
  // bit/s; 0: frames take no time, and on CAN drives answer at once
  std::int64_t bitrate = 1'000'000;
  // Adapter of the hosts, from adapter_profiles(); null: none.
  const AdapterProfile* adapter = nullptr;
  HostQueue host_queue = host_queues().front();  // CAN
  // Another node than the drives acknowledges each frame of the hosts, CAN.
  bool always_acknowledged = false;
  std::uint64_t seed = 1;
  std::optional<SerialConfig> serial;  // parameters of RS-485; absent: CAN
  std::vector<ServoConfig> servos;     // ascending, distinct IDs
  std::vector<TimedDirective> events;  // ascending times; planned when the bus is constructed
  // Body whose joints the drives turn, the same for all buses of a robot; each run uses a copy.
  // Null: no body.
  std::shared_ptr<const Mechanism> body;
  // Signals of the body; null: none.
  std::shared_ptr<const BodySignals> body_signals;
  // Inner resistance of the battery that all buses of a robot share. Pre: the same value on each
  // bus. 0: no battery; each drive has a separate source.
  double battery_R_ohm = 0;
};

}  // namespace lk::emulator

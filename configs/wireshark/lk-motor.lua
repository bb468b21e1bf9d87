-- Wireshark: LK-TECH motors on CAN. Written by lk-emu-formats of lk-emu from its tables of commands; docs/dbc.md
-- tells how to use it. Preferences (Protocols > LK.MOTOR) tell what frames alone do not: generation and series.

local generations = { { 1, "legacy", 0 }, { 2, "late-legacy", 1 }, { 3, "v235", 2 }, { 4, "v236", 3 } }

local commands = {
  [0x19] = { name = "write present position to ROM as zero", echo = false },
  [0x30] = { name = "read PID", echo = false },
  [0x31] = { name = "write PID to RAM", echo = true },
  [0x32] = { name = "write PID to ROM", echo = true },
  [0x33] = { name = "read acceleration", echo = false },
  [0x34] = { name = "write acceleration to RAM", echo = true },
  [0x80] = { name = "off", echo = true },
  [0x81] = { name = "stop", echo = true },
  [0x88] = { name = "run", echo = true },
  [0x8C] = { name = "brake", echo = false },
  [0x90] = { name = "read encoder", echo = false },
  [0x91] = { name = "write encoder offset to ROM", echo = true },
  [0x92] = { name = "read multi-turn angle", echo = false },
  [0x94] = { name = "read single-turn angle", echo = false },
  [0x95] = { name = "clear angle", echo = true },
  [0x9A] = { name = "read state 1", echo = false },
  [0x9B] = { name = "clear errors", echo = false },
  [0x9C] = { name = "read state 2", echo = false },
  [0x9D] = { name = "read state 3", echo = false },
  [0xA0] = { name = "open-loop power", echo = false },
  [0xA1] = { name = "torque", echo = false },
  [0xA2] = { name = "speed", echo = false },
  [0xA3] = { name = "position 1, multi-turn", echo = false },
  [0xA4] = { name = "position 2, multi-turn, max speed", echo = false },
  [0xA5] = { name = "position 3, single-turn", echo = false },
  [0xA6] = { name = "position 4, single-turn, max speed", echo = false },
  [0xA7] = { name = "position 5, increment", echo = false },
  [0xA8] = { name = "position 6, increment, max speed", echo = false },
  [0xC0] = { name = "read parameter", echo = false },
  [0xC1] = { name = "write parameter to RAM", echo = true },
}

local several = {
  [0x280] = { name = "torque" },
  [0x281] = { name = "speed" },
  [0x282] = { name = "position, multi-turn" },
  [0x288] = { name = "any single command" },
}

local names = {
  acceleration = { label = "Acceleration", kind = "int", unit = "°/s²" },
  action = { label = "Action", kind = "uint", unit = "", values = { [0] = "engage", [1] = "release", [16] = "read", } },
  angle_kd = { label = "Kd of the angle loop", kind = "uint", unit = "" },
  angle_ki = { label = "Ki of the angle loop", kind = "uint", unit = "" },
  angle_kp = { label = "Kp of the angle loop", kind = "uint", unit = "" },
  angle_target = { label = "Target angle", kind = "double", unit = "°" },
  angle_target_1 = { label = "Drive 1", kind = "int", unit = "°" },
  angle_target_2 = { label = "Drive 2", kind = "int", unit = "°" },
  angle_target_3 = { label = "Drive 3", kind = "int", unit = "°" },
  angle_target_4 = { label = "Drive 4", kind = "int", unit = "°" },
  bridge = { label = "Bridge", kind = "uint", unit = "", values = { [0] = "on", [16] = "off", } },
  bus_current = { label = "Bus current", kind = "double", unit = "A" },
  coil = { label = "Coil of the brake", kind = "uint", unit = "", values = { [0] = "unpowered, the brake holds", [1] = "powered, the brake is open", } },
  command_1 = { label = "Drive 1", kind = "uint", unit = "", values = { [0] = "nothing", [25] = "write present position to ROM as zero", [128] = "off", [129] = "stop", [136] = "run", [140] = "brake", [144] = "read encoder", [146] = "read multi-turn angle", [148] = "read single-turn angle", [149] = "clear angle", [154] = "read state 1", [155] = "clear errors", [156] = "read state 2", [157] = "read state 3", [161] = "torque", [162] = "speed", [163] = "position 1, multi-turn", [164] = "position 2, multi-turn, max speed", [165] = "position 3, single-turn", [166] = "position 4, single-turn, max speed", [167] = "position 5, increment", [168] = "position 6, increment, max speed", [192] = "read parameter", [193] = "write parameter to RAM", } },
  command_2 = { label = "Drive 2", kind = "uint", unit = "", values = { [0] = "nothing", [25] = "write present position to ROM as zero", [128] = "off", [129] = "stop", [136] = "run", [140] = "brake", [144] = "read encoder", [146] = "read multi-turn angle", [148] = "read single-turn angle", [149] = "clear angle", [154] = "read state 1", [155] = "clear errors", [156] = "read state 2", [157] = "read state 3", [161] = "torque", [162] = "speed", [163] = "position 1, multi-turn", [164] = "position 2, multi-turn, max speed", [165] = "position 3, single-turn", [166] = "position 4, single-turn, max speed", [167] = "position 5, increment", [168] = "position 6, increment, max speed", [192] = "read parameter", [193] = "write parameter to RAM", } },
  command_3 = { label = "Drive 3", kind = "uint", unit = "", values = { [0] = "nothing", [25] = "write present position to ROM as zero", [128] = "off", [129] = "stop", [136] = "run", [140] = "brake", [144] = "read encoder", [146] = "read multi-turn angle", [148] = "read single-turn angle", [149] = "clear angle", [154] = "read state 1", [155] = "clear errors", [156] = "read state 2", [157] = "read state 3", [161] = "torque", [162] = "speed", [163] = "position 1, multi-turn", [164] = "position 2, multi-turn, max speed", [165] = "position 3, single-turn", [166] = "position 4, single-turn, max speed", [167] = "position 5, increment", [168] = "position 6, increment, max speed", [192] = "read parameter", [193] = "write parameter to RAM", } },
  command_4 = { label = "Drive 4", kind = "uint", unit = "", values = { [0] = "nothing", [25] = "write present position to ROM as zero", [128] = "off", [129] = "stop", [136] = "run", [140] = "brake", [144] = "read encoder", [146] = "read multi-turn angle", [148] = "read single-turn angle", [149] = "clear angle", [154] = "read state 1", [155] = "clear errors", [156] = "read state 2", [157] = "read state 3", [161] = "torque", [162] = "speed", [163] = "position 1, multi-turn", [164] = "position 2, multi-turn, max speed", [165] = "position 3, single-turn", [166] = "position 4, single-turn, max speed", [167] = "position 5, increment", [168] = "position 6, increment, max speed", [192] = "read parameter", [193] = "write parameter to RAM", } },
  direction = { label = "Direction", kind = "uint", unit = "", values = { [0] = "clockwise", [1] = "counterclockwise", } },
  encoder = { label = "Encoder", kind = "uint", unit = "" },
  encoder_offset = { label = "Encoder offset", kind = "uint", unit = "" },
  encoder_position = { label = "Encoder", kind = "uint", unit = "" },
  encoder_raw = { label = "Encoder, raw", kind = "uint", unit = "" },
  error_driver_temperature = { label = "Driver over-temperature", kind = "flag", unit = "" },
  error_lost_input = { label = "Lost input", kind = "flag", unit = "" },
  error_motor_temperature = { label = "Motor over-temperature", kind = "flag", unit = "" },
  error_over_current = { label = "Over-current", kind = "flag", unit = "" },
  error_over_voltage = { label = "Over-voltage", kind = "flag", unit = "" },
  error_short_circuit = { label = "Short circuit", kind = "flag", unit = "" },
  error_stall = { label = "Stall", kind = "flag", unit = "" },
  error_under_voltage = { label = "Under-voltage", kind = "flag", unit = "" },
  i_a = { label = "Current of phase a", kind = "double", unit = "A" },
  i_b = { label = "Current of phase b", kind = "double", unit = "A" },
  i_c = { label = "Current of phase c", kind = "double", unit = "A" },
  increment = { label = "Increment", kind = "double", unit = "°" },
  iq = { label = "Torque current", kind = "double", unit = "A" },
  iq_kd = { label = "Kd of the current loop", kind = "uint", unit = "" },
  iq_ki = { label = "Ki of the current loop", kind = "uint", unit = "" },
  iq_kp = { label = "Kp of the current loop", kind = "uint", unit = "" },
  iq_limit = { label = "Limit of the torque current", kind = "double", unit = "A" },
  iq_target = { label = "Target torque current", kind = "double", unit = "A" },
  iq_target_1 = { label = "Drive 1", kind = "double", unit = "A" },
  iq_target_2 = { label = "Drive 2", kind = "double", unit = "A" },
  iq_target_3 = { label = "Drive 3", kind = "double", unit = "A" },
  iq_target_4 = { label = "Drive 4", kind = "double", unit = "A" },
  max_speed = { label = "Max speed", kind = "uint", unit = "°/s" },
  multi_turn_angle = { label = "Multi-turn angle", kind = "double", unit = "°" },
  new_angle = { label = "New multi-turn angle", kind = "double", unit = "°" },
  parameter = { label = "Parameter", kind = "uint", unit = "", values = { [10] = "gains of the angle loop", [11] = "gains of the speed loop", [12] = "gains of the current loop", [30] = "Max Torque Current, on MS Max Power", [32] = "Max Speed", [34] = "Max Angle", [36] = "current ramp", [38] = "speed ramp", } },
  power = { label = "Power", kind = "double", unit = "%" },
  power_target = { label = "Power", kind = "double", unit = "%" },
  read_parameter = { label = "Parameter", kind = "uint", unit = "", values = { [10] = "gains of the angle loop", [11] = "gains of the speed loop", [12] = "gains of the current loop", [30] = "Max Torque Current, on MS Max Power", [32] = "Max Speed", [34] = "Max Angle", [36] = "current ramp", [38] = "speed ramp", } },
  register_current_ramp = { label = "Current ramp", kind = "double", unit = "A/s" },
  register_max_angle = { label = "Max Angle", kind = "double", unit = "°" },
  register_max_power = { label = "Max Power", kind = "double", unit = "%" },
  register_max_speed = { label = "Max Speed", kind = "double", unit = "°/s" },
  register_max_torque_current = { label = "Max Torque Current", kind = "double", unit = "A" },
  register_speed_ramp = { label = "Speed ramp", kind = "int", unit = "°/s²" },
  single_turn_angle = { label = "Single-turn angle", kind = "double", unit = "°" },
  single_turn_target = { label = "Target angle, single-turn", kind = "double", unit = "°" },
  speed = { label = "Speed", kind = "int", unit = "°/s" },
  speed_kd = { label = "Kd of the speed loop", kind = "uint", unit = "" },
  speed_ki = { label = "Ki of the speed loop", kind = "uint", unit = "" },
  speed_kp = { label = "Kp of the speed loop", kind = "uint", unit = "" },
  speed_target = { label = "Target speed", kind = "double", unit = "°/s" },
  speed_target_1 = { label = "Drive 1", kind = "int", unit = "°/s" },
  speed_target_2 = { label = "Drive 2", kind = "int", unit = "°/s" },
  speed_target_3 = { label = "Drive 3", kind = "int", unit = "°/s" },
  speed_target_4 = { label = "Drive 4", kind = "int", unit = "°/s" },
  temperature = { label = "Temperature", kind = "int", unit = "°C" },
  voltage = { label = "Voltage", kind = "double", unit = "V" },
}

local layouts = {
  { },
  { { "encoder_offset", 48, 16, false, 1 }, },
  { { "angle_kp", 16, 8, false, 1 }, { "angle_ki", 24, 8, false, 1 }, { "speed_kp", 32, 8, false, 1 }, { "speed_ki", 40, 8, false, 1 }, { "iq_kp", 48, 8, false, 1 }, { "iq_ki", 56, 8, false, 1 }, },
  { { "acceleration", 32, 32, true, 1 }, },
  { { "encoder_position", 16, 16, false, 1 }, { "encoder_raw", 32, 16, false, 1 }, { "encoder_offset", 48, 16, false, 1 }, },
  { { "multi_turn_angle", 8, 56, true, 0.01 }, },
  { { "single_turn_angle", 48, 16, false, 0.01 }, },
  { { "temperature", 8, 8, true, 1 }, { "voltage", 24, 16, false, 0.1 }, { "error_under_voltage", 56, 1, false, 1 }, { "error_over_voltage", 57, 1, false, 1 }, { "error_driver_temperature", 58, 1, false, 1 }, { "error_motor_temperature", 59, 1, false, 1 }, { "error_over_current", 60, 1, false, 1 }, { "error_short_circuit", 61, 1, false, 1 }, { "error_stall", 62, 1, false, 1 }, { "error_lost_input", 63, 1, false, 1 }, },
  { { "temperature", 8, 8, true, 1 }, { "iq", 16, 16, true, 0.01611328125 }, { "speed", 32, 16, true, 1 }, { "encoder", 48, 16, false, 1 }, },
  { { "temperature", 8, 8, true, 1 }, { "i_a", 16, 16, true, 0.015625 }, { "i_b", 32, 16, true, 0.015625 }, { "i_c", 48, 16, true, 0.015625 }, },
  { { "iq_target", 32, 16, true, 0.016 }, },
  { { "speed_target", 32, 32, true, 0.01 }, },
  { { "angle_target", 32, 32, true, 0.01 }, },
  { { "angle_target", 32, 32, true, 0.01 }, { "max_speed", 16, 16, false, 1 }, },
  { { "single_turn_target", 32, 16, false, 0.01 }, { "direction", 8, 8, false, 1 }, },
  { { "single_turn_target", 32, 16, false, 0.01 }, { "direction", 8, 8, false, 1 }, { "max_speed", 16, 16, false, 1 }, },
  { { "increment", 32, 32, true, 0.01 }, },
  { { "increment", 32, 32, true, 0.01 }, { "max_speed", 16, 16, false, 1 }, },
  { { "iq_target_1", 0, 16, true, 0.016 }, { "iq_target_2", 16, 16, true, 0.016 }, { "iq_target_3", 32, 16, true, 0.016 }, { "iq_target_4", 48, 16, true, 0.016 }, },
  { { "temperature", 8, 8, true, 1 }, { "power", 16, 16, true, 0.1 }, { "speed", 32, 16, true, 1 }, { "encoder", 48, 16, false, 1 }, },
  { { "single_turn_angle", 32, 32, false, 0.01 }, },
  { { "temperature", 8, 8, true, 1 }, { "iq", 16, 16, true, 0.008056640625 }, { "speed", 32, 16, true, 1 }, { "encoder", 48, 16, false, 1 }, },
  { { "iq_target", 32, 16, true, 0.008056640625 }, },
  { { "iq_target_1", 0, 16, true, 0.008056640625 }, { "iq_target_2", 16, 16, true, 0.008056640625 }, { "iq_target_3", 32, 16, true, 0.008056640625 }, { "iq_target_4", 48, 16, true, 0.008056640625 }, },
  { { "iq_target", 32, 16, true, 0.01611328125 }, },
  { { "iq_target_1", 0, 16, true, 0.01611328125 }, { "iq_target_2", 16, 16, true, 0.01611328125 }, { "iq_target_3", 32, 16, true, 0.01611328125 }, { "iq_target_4", 48, 16, true, 0.01611328125 }, },
  { { "temperature", 8, 8, true, 1 }, { "voltage", 16, 16, false, 0.01 }, { "error_under_voltage", 56, 1, false, 1 }, { "error_over_voltage", 57, 1, false, 1 }, { "error_driver_temperature", 58, 1, false, 1 }, { "error_motor_temperature", 59, 1, false, 1 }, { "error_over_current", 60, 1, false, 1 }, { "error_short_circuit", 61, 1, false, 1 }, { "error_stall", 62, 1, false, 1 }, { "error_lost_input", 63, 1, false, 1 }, },
  { { "single_turn_target", 32, 32, false, 0.01 }, { "direction", 8, 8, false, 1 }, },
  { { "single_turn_target", 32, 32, false, 0.01 }, { "direction", 8, 8, false, 1 }, { "max_speed", 16, 16, false, 1 }, },
  { { "power_target", 32, 16, true, 0.1 }, },
  { { "action", 8, 8, false, 1 }, },
  { { "coil", 8, 8, false, 1 }, },
  { { "new_angle", 32, 32, true, 0.01 }, },
  { { "temperature", 8, 8, true, 1 }, { "voltage", 16, 16, false, 0.01 }, { "error_under_voltage", 56, 1, false, 1 }, { "error_over_voltage", 57, 1, false, 1 }, { "error_driver_temperature", 58, 1, false, 1 }, { "error_motor_temperature", 59, 1, false, 1 }, { "error_over_current", 60, 1, false, 1 }, { "error_short_circuit", 61, 1, false, 1 }, { "error_stall", 62, 1, false, 1 }, { "error_lost_input", 63, 1, false, 1 }, { "bus_current", 32, 16, true, 0.01 }, { "bridge", 48, 8, false, 1 }, },
  { { "temperature", 8, 8, true, 1 }, { "i_a", 16, 16, true, 0.008056640625 }, { "i_b", 32, 16, true, 0.008056640625 }, { "i_c", 48, 16, true, 0.008056640625 }, },
  { { "speed_target", 32, 32, true, 0.01 }, { "iq_limit", 16, 16, true, 0.008056640625 }, },
  { { "read_parameter", 8, 8, false, 1 }, },
  { { "parameter", 8, 8, false, 1 }, { "angle_kp", 16, 16, false, 1, 10 }, { "angle_ki", 32, 16, false, 1, 10 }, { "angle_kd", 48, 16, false, 1, 10 }, { "speed_kp", 16, 16, false, 1, 11 }, { "speed_ki", 32, 16, false, 1, 11 }, { "speed_kd", 48, 16, false, 1, 11 }, { "iq_kp", 16, 16, false, 1, 12 }, { "iq_ki", 32, 16, false, 1, 12 }, { "iq_kd", 48, 16, false, 1, 12 }, { "register_max_torque_current", 32, 16, true, 0.008056640625, 30 }, { "register_max_speed", 32, 32, true, 0.01, 32 }, { "register_max_angle", 32, 32, true, 0.01, 34 }, { "register_current_ramp", 32, 32, true, 0.001, 36 }, { "register_speed_ramp", 32, 32, true, 1, 38 }, },
  { { "speed_target_1", 0, 16, true, 1 }, { "speed_target_2", 16, 16, true, 1 }, { "speed_target_3", 32, 16, true, 1 }, { "speed_target_4", 48, 16, true, 1 }, },
  { { "angle_target_1", 0, 16, true, 1 }, { "angle_target_2", 16, 16, true, 1 }, { "angle_target_3", 32, 16, true, 1 }, { "angle_target_4", 48, 16, true, 1 }, },
  { { "command_1", 0, 8, false, 1 }, { "command_2", 16, 8, false, 1 }, { "command_3", 32, 8, false, 1 }, { "command_4", 48, 8, false, 1 }, },
  { { "temperature", 8, 8, true, 1 }, { "i_a", 16, 16, true, 0.01611328125 }, { "i_b", 32, 16, true, 0.01611328125 }, { "i_c", 48, 16, true, 0.01611328125 }, },
  { { "speed_target", 32, 32, true, 0.01 }, { "iq_limit", 16, 16, true, 0.01611328125 }, },
  { { "parameter", 8, 8, false, 1 }, { "angle_kp", 16, 16, false, 1, 10 }, { "angle_ki", 32, 16, false, 1, 10 }, { "angle_kd", 48, 16, false, 1, 10 }, { "speed_kp", 16, 16, false, 1, 11 }, { "speed_ki", 32, 16, false, 1, 11 }, { "speed_kd", 48, 16, false, 1, 11 }, { "iq_kp", 16, 16, false, 1, 12 }, { "iq_ki", 32, 16, false, 1, 12 }, { "iq_kd", 48, 16, false, 1, 12 }, { "register_max_torque_current", 32, 16, true, 0.01611328125, 30 }, { "register_max_speed", 32, 32, true, 0.01, 32 }, { "register_max_angle", 32, 32, true, 0.01, 34 }, { "register_current_ramp", 32, 32, true, 0.001, 36 }, { "register_speed_ramp", 32, 32, true, 1, 38 }, },
  { { "parameter", 8, 8, false, 1 }, { "angle_kp", 16, 16, false, 1, 10 }, { "angle_ki", 32, 16, false, 1, 10 }, { "angle_kd", 48, 16, false, 1, 10 }, { "speed_kp", 16, 16, false, 1, 11 }, { "speed_ki", 32, 16, false, 1, 11 }, { "speed_kd", 48, 16, false, 1, 11 }, { "iq_kp", 16, 16, false, 1, 12 }, { "iq_ki", 32, 16, false, 1, 12 }, { "iq_kd", 48, 16, false, 1, 12 }, { "register_max_power", 32, 16, true, 0.1, 30 }, { "register_max_speed", 32, 32, true, 0.01, 32 }, { "register_max_angle", 32, 32, true, 0.01, 34 }, { "register_current_ramp", 32, 32, true, 0.001, 36 }, { "register_speed_ramp", 32, 32, true, 1, 38 }, },
}

local formats = {
  { -- legacy
    { -- MF, MH
      queries = { [0x19] = layouts[1], [0x30] = layouts[1], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[1], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[11], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[15], [0xA6] = layouts[16], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x30] = layouts[3], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[4], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[7], [0x95] = layouts[1], [0x9A] = layouts[8], [0x9B] = layouts[8], [0x9C] = layouts[9], [0x9D] = layouts[10], [0xA1] = layouts[9], [0xA2] = layouts[9], [0xA3] = layouts[9], [0xA4] = layouts[9], [0xA5] = layouts[9], [0xA6] = layouts[9], [0xA7] = layouts[9], [0xA8] = layouts[9], },
      several = { [0x280] = layouts[19], },
    },
    { -- MG
      queries = { [0x19] = layouts[1], [0x30] = layouts[1], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[1], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[11], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[15], [0xA6] = layouts[16], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x30] = layouts[3], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[4], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[7], [0x95] = layouts[1], [0x9A] = layouts[8], [0x9B] = layouts[8], [0x9C] = layouts[9], [0x9D] = layouts[10], [0xA1] = layouts[9], [0xA2] = layouts[9], [0xA3] = layouts[9], [0xA4] = layouts[9], [0xA5] = layouts[9], [0xA6] = layouts[9], [0xA7] = layouts[9], [0xA8] = layouts[9], },
      several = { [0x280] = layouts[19], },
    },
    { -- MS
      queries = { [0x19] = layouts[1], [0x30] = layouts[1], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[1], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[15], [0xA6] = layouts[16], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x30] = layouts[3], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[4], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[7], [0x95] = layouts[1], [0x9A] = layouts[8], [0x9B] = layouts[8], [0x9C] = layouts[20], [0xA2] = layouts[20], [0xA3] = layouts[20], [0xA4] = layouts[20], [0xA5] = layouts[20], [0xA6] = layouts[20], [0xA7] = layouts[20], [0xA8] = layouts[20], },
      several = { },
    },
  },
  { -- late-legacy
    { -- MF, MH
      queries = { [0x19] = layouts[1], [0x30] = layouts[1], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[1], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[23], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[15], [0xA6] = layouts[16], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x30] = layouts[3], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[4], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[1], [0x9A] = layouts[8], [0x9B] = layouts[8], [0x9C] = layouts[22], [0x9D] = layouts[10], [0xA1] = layouts[22], [0xA2] = layouts[22], [0xA3] = layouts[22], [0xA4] = layouts[22], [0xA5] = layouts[22], [0xA6] = layouts[22], [0xA7] = layouts[22], [0xA8] = layouts[22], },
      several = { [0x280] = layouts[24], },
    },
    { -- MG
      queries = { [0x19] = layouts[1], [0x30] = layouts[1], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[1], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[25], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[15], [0xA6] = layouts[16], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x30] = layouts[3], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[4], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[1], [0x9A] = layouts[8], [0x9B] = layouts[8], [0x9C] = layouts[9], [0x9D] = layouts[10], [0xA1] = layouts[9], [0xA2] = layouts[9], [0xA3] = layouts[9], [0xA4] = layouts[9], [0xA5] = layouts[9], [0xA6] = layouts[9], [0xA7] = layouts[9], [0xA8] = layouts[9], },
      several = { [0x280] = layouts[26], },
    },
    { -- MS
      queries = { [0x19] = layouts[1], [0x30] = layouts[1], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[1], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[15], [0xA6] = layouts[16], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x30] = layouts[3], [0x31] = layouts[3], [0x32] = layouts[3], [0x33] = layouts[4], [0x34] = layouts[4], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[1], [0x9A] = layouts[8], [0x9B] = layouts[8], [0x9C] = layouts[20], [0xA2] = layouts[20], [0xA3] = layouts[20], [0xA4] = layouts[20], [0xA5] = layouts[20], [0xA6] = layouts[20], [0xA7] = layouts[20], [0xA8] = layouts[20], },
      several = { },
    },
  },
  { -- v235
    { -- MF, MH
      queries = { [0x19] = layouts[1], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[23], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[28], [0xA6] = layouts[29], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[1], [0x9A] = layouts[27], [0x9B] = layouts[27], [0x9C] = layouts[22], [0x9D] = layouts[10], [0xA1] = layouts[22], [0xA2] = layouts[22], [0xA3] = layouts[22], [0xA4] = layouts[22], [0xA5] = layouts[22], [0xA6] = layouts[22], [0xA7] = layouts[22], [0xA8] = layouts[22], },
      several = { [0x280] = layouts[24], },
    },
    { -- MG
      queries = { [0x19] = layouts[1], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[25], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[28], [0xA6] = layouts[29], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[1], [0x9A] = layouts[27], [0x9B] = layouts[27], [0x9C] = layouts[9], [0x9D] = layouts[10], [0xA1] = layouts[9], [0xA2] = layouts[9], [0xA3] = layouts[9], [0xA4] = layouts[9], [0xA5] = layouts[9], [0xA6] = layouts[9], [0xA7] = layouts[9], [0xA8] = layouts[9], },
      several = { [0x280] = layouts[26], },
    },
    { -- MS
      queries = { [0x19] = layouts[1], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[1], [0x91] = layouts[2], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[1], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0xA0] = layouts[30], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[28], [0xA6] = layouts[29], [0xA7] = layouts[17], [0xA8] = layouts[18], },
      replies = { [0x19] = layouts[2], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x90] = layouts[5], [0x91] = layouts[2], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[1], [0x9A] = layouts[27], [0x9B] = layouts[27], [0x9C] = layouts[20], [0xA0] = layouts[20], [0xA2] = layouts[20], [0xA3] = layouts[20], [0xA4] = layouts[20], [0xA5] = layouts[20], [0xA6] = layouts[20], [0xA7] = layouts[20], [0xA8] = layouts[20], },
      several = { },
    },
  },
  { -- v236
    { -- MF, MH
      queries = { [0x19] = layouts[1], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x8C] = layouts[31], [0x90] = layouts[1], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[33], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[23], [0xA2] = layouts[36], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[28], [0xA6] = layouts[29], [0xA7] = layouts[17], [0xA8] = layouts[18], [0xC0] = layouts[37], [0xC1] = layouts[38], },
      replies = { [0x19] = layouts[2], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x8C] = layouts[32], [0x90] = layouts[5], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[33], [0x9A] = layouts[34], [0x9B] = layouts[34], [0x9C] = layouts[22], [0x9D] = layouts[35], [0xA1] = layouts[22], [0xA2] = layouts[22], [0xA3] = layouts[22], [0xA4] = layouts[22], [0xA5] = layouts[22], [0xA6] = layouts[22], [0xA7] = layouts[22], [0xA8] = layouts[22], [0xC0] = layouts[38], [0xC1] = layouts[38], },
      several = { [0x280] = layouts[24], [0x281] = layouts[39], [0x282] = layouts[40], [0x288] = layouts[41], },
    },
    { -- MG
      queries = { [0x19] = layouts[1], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x8C] = layouts[31], [0x90] = layouts[1], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[33], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0x9D] = layouts[1], [0xA1] = layouts[25], [0xA2] = layouts[43], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[28], [0xA6] = layouts[29], [0xA7] = layouts[17], [0xA8] = layouts[18], [0xC0] = layouts[37], [0xC1] = layouts[44], },
      replies = { [0x19] = layouts[2], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x8C] = layouts[32], [0x90] = layouts[5], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[33], [0x9A] = layouts[34], [0x9B] = layouts[34], [0x9C] = layouts[9], [0x9D] = layouts[42], [0xA1] = layouts[9], [0xA2] = layouts[9], [0xA3] = layouts[9], [0xA4] = layouts[9], [0xA5] = layouts[9], [0xA6] = layouts[9], [0xA7] = layouts[9], [0xA8] = layouts[9], [0xC0] = layouts[44], [0xC1] = layouts[44], },
      several = { [0x280] = layouts[26], [0x281] = layouts[39], [0x282] = layouts[40], [0x288] = layouts[41], },
    },
    { -- MS
      queries = { [0x19] = layouts[1], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x8C] = layouts[31], [0x90] = layouts[1], [0x92] = layouts[1], [0x94] = layouts[1], [0x95] = layouts[33], [0x9A] = layouts[1], [0x9B] = layouts[1], [0x9C] = layouts[1], [0xA0] = layouts[30], [0xA2] = layouts[12], [0xA3] = layouts[13], [0xA4] = layouts[14], [0xA5] = layouts[28], [0xA6] = layouts[29], [0xA7] = layouts[17], [0xA8] = layouts[18], [0xC0] = layouts[37], [0xC1] = layouts[45], },
      replies = { [0x19] = layouts[2], [0x80] = layouts[1], [0x81] = layouts[1], [0x88] = layouts[1], [0x8C] = layouts[32], [0x90] = layouts[5], [0x92] = layouts[6], [0x94] = layouts[21], [0x95] = layouts[33], [0x9A] = layouts[34], [0x9B] = layouts[34], [0x9C] = layouts[20], [0xA0] = layouts[20], [0xA2] = layouts[20], [0xA3] = layouts[20], [0xA4] = layouts[20], [0xA5] = layouts[20], [0xA6] = layouts[20], [0xA7] = layouts[20], [0xA8] = layouts[20], [0xC0] = layouts[45], [0xC1] = layouts[45], },
      several = { [0x281] = layouts[39], [0x282] = layouts[40], [0x288] = layouts[41], },
    },
  },
}

local proto = Proto("lk.motor", "LK-TECH motor")
local QUERY, REPLY = 0, 1
local ECHO_OR_NOT, SURELY = 1, 2
local LONGEST_REPLY_S = 0.1 -- assumed, as everywhere in lk-emu: a drive answers within 1 ms
local SINGLE_ID, DRIVES = 0x140, 32

-- One Wireshark field for each name.

local meta = {
  drive = ProtoField.uint8("lk.motor.drive", "Drive"),
  kind = ProtoField.uint8("lk.motor.kind", "Kind", base.DEC, { [QUERY] = "query", [REPLY] = "reply" }),
  command = ProtoField.uint8("lk.motor.command", "Command", base.HEX),
  command_name = ProtoField.string("lk.motor.command_name", "Command name"),
  reply_in = ProtoField.framenum("lk.motor.reply_in", "Reply in frame", base.NONE, frametype.RESPONSE),
  reply_to = ProtoField.framenum("lk.motor.reply_to", "Reply to frame", base.NONE, frametype.REQUEST),
  response_time = ProtoField.relative_time("lk.motor.response_time", "Response time"),
}

local function proto_field(name, about)
  local filter = "lk.motor." .. name
  if about.kind == "flag" then return ProtoField.bool(filter, about.label) end
  if about.kind == "double" then return ProtoField.double(filter, about.label) end
  if about.kind == "int" then return ProtoField.int32(filter, about.label, base.DEC, about.values) end
  return ProtoField.uint32(filter, about.label, base.DEC, about.values)
end

local all_fields = {}
for _, field in pairs(meta) do all_fields[#all_fields + 1] = field end
for name, about in pairs(names) do
  about.field = proto_field(name, about)
  all_fields[#all_fields + 1] = about.field
end
proto.fields = all_fields

local experts = {
  unanswered = ProtoExpert.new("lk.motor.unanswered", "No reply in this capture",
    expert.group.SEQUENCE, expert.severity.WARN),
  orphan = ProtoExpert.new("lk.motor.orphan", "A reply, but to no query of this capture",
    expert.group.SEQUENCE, expert.severity.NOTE),
  errors = ProtoExpert.new("lk.motor.errors", "The drive reports an error",
    expert.group.RESPONSE_CODE, expert.severity.ERROR),
  unknown = ProtoExpert.new("lk.motor.unknown_command", "No command of this generation and series: no drive answers",
    expert.group.PROTOCOL, expert.severity.WARN),
  length = ProtoExpert.new("lk.motor.wrong_length", "Not 8 bytes: no drive answers",
    expert.group.MALFORMED, expert.severity.WARN),
}
proto.experts = { experts.unanswered, experts.orphan, experts.errors, experts.unknown, experts.length }

proto.prefs.generation = Pref.enum("Generation", 0, "Firmware of the drives",
  generations, false)
proto.prefs.series = Pref.enum("Series", 0, "Series of the drives: how much one LSB of a current is",
  { { 1, "MF, MH", 0 }, { 2, "MG", 1 }, { 3, "MS", 2 } }, false)
proto.prefs.reply_base = Pref.enum("Identifier of replies", SINGLE_ID, "Where drives answer",
  { { 1, "0x140 + ID", SINGLE_ID }, { 2, "0x180 + ID", 0x180 }, { 3, "0x240 + ID", 0x240 } }, false)

local function format()
  return formats[proto.prefs.generation + 1][proto.prefs.series + 1]
end

-- Numbers of a frame.

local function byte(tvb, n) return tvb(n, 1):uint() end

-- From the top down, so that a 56-bit number stays exact as long as a double can hold it.
local function raw_value(tvb, first_bit, bits, is_signed)
  local first = math.floor(first_bit / 8)
  if bits < 8 then return math.floor(byte(tvb, first) / 2 ^ (first_bit % 8)) % 2 ^ bits end
  local last = first + bits / 8 - 1
  local value = byte(tvb, last)
  if is_signed and value >= 128 then value = value - 256 end
  for n = last - 1, first, -1 do value = value * 256 + byte(tvb, n) end
  return value
end

-- 0.57 and not 0.57000000000000006.
local function scaled(raw, lsb)
  if lsb == 1 then return raw end
  return tonumber(string.format("%.15g", raw * lsb))
end

-- "°" stands at its number, other units apart.
local function unit_text(about)
  if about.unit == "" then return "" end
  local apart = about.unit == "°C" or about.unit:sub(1, #"°") ~= "°"
  return (apart and " " or "") .. about.unit
end

local function words(about, value)
  if about.values and about.values[value] then return about.values[value] end
  if about.unit == "A" then value = tonumber(string.format("%.3f", value)) end
  return string.format("%.15g", value) .. unit_text(about)
end

-- Who asks and who answers. Both use one identifier, so the order tells, by the rules of docs/record.md: a frame is a
-- reply when a query of its drive waits to which it can be one.

local state -- of the capture: what its frames were found to be

local function new_state() state = { frames = {}, drives = {}, several = {} } end
new_state()
function proto.init() new_state() end

local function drive_state(bus, id)
  local key = bus .. ":" .. id
  state.drives[key] = state.drives[key] or { pending = {}, seen_several = 0, run = nil }
  return state.drives[key]
end

local function same(a, b)
  for n = 1, 8 do
    if a[n] ~= b[n] then return false end
  end
  return true
end

local function is_state(command) return (command >= 0x9A and command <= 0x9D) or (command >= 0xA0 and command <= 0xA8) end

-- Can a frame with `data` answer the query? nil: no.
local function fit(asked, data, surely_a_reply)
  if asked.command ~= data[1] then return nil end
  -- The reply to a read parameter repeats which one.
  if data[1] == 0xC0 and not asked.several and asked.data[2] ~= data[2] then return nil end
  if surely_a_reply then return SURELY end
  local equal = same(asked.data, data)
  if commands[data[1]].echo then return equal and ECHO_OR_NOT or nil end
  -- DATA[1] of a state is a temperature; a host has nothing there, or a direction.
  if is_state(data[1]) then return not equal and data[2] > 1 and SURELY or nil end
  return equal and ECHO_OR_NOT or SURELY
end

-- The reply to a command for several drives, from the drive `id`.
local function command_for(query, id)
  local own = { [0x280] = 0xA1, [0x281] = 0xA2, [0x282] = 0xA3 }
  if own[query.id] then return own[query.id] end
  local command = id <= 4 and query.data[2 * id - 1] or 0
  return commands[command] and command or nil
end

-- What was asked of all drives since the last frame of this one.
local function take_several(drive, bus, id, now)
  for n = drive.seen_several + 1, #state.several do
    local query = state.several[n]
    local command = query.bus == bus and command_for(query, id)
    if query.bus == bus then drive.run = nil end
    if command and now - query.time <= LONGEST_REPLY_S then
      drive.pending[#drive.pending + 1] =
        { frame = query.frame, time = query.time, command = command, data = query.data, several = true }
    end
  end
  drive.seen_several = #state.several
end

local function drop_old(drive, now)
  while drive.pending[1] and now - drive.pending[1].time > LONGEST_REPLY_S do table.remove(drive.pending, 1) end
end

local function unlink(asked, reply)
  local replies = state.frames[asked.frame].replies
  for n = #replies, 1, -1 do
    if replies[n] == reply then table.remove(replies, n) end
  end
end

local function link(asked, reply, time)
  local record = state.frames[reply]
  if record.asked then unlink(record.asked, reply) end
  record.kind, record.asked, record.delay = REPLY, asked, time - asked.time
  local replies = state.frames[asked.frame].replies
  replies[#replies + 1] = reply
end

-- Of several queries that a frame can answer those got no reply that came first: as many replies as follow each other
-- belong to as many of the last queries. So each further reply of a run moves those before it to an earlier query.
local function continue_run(drive, frame, time, data, sure)
  local run = drive.run
  if not run or #run.replies == #run.asked then return false end
  local last = run.asked[#run.asked]
  if time - last.time > LONGEST_REPLY_S or fit(last, data, sure) ~= SURELY then return false end
  run.replies[#run.replies + 1] = { frame = frame, time = time }
  for n, reply in ipairs(run.replies) do
    link(run.asked[#run.asked - #run.replies + n], reply.frame, reply.time)
  end
  return true
end

local function start_run(drive, frame, time, data, sure)
  local asked, last = {}, 0
  for n, query in ipairs(drive.pending) do
    if fit(query, data, sure) then
      asked[#asked + 1] = query
      last = n
    end
  end
  if last == 0 then return false end
  for _ = 1, last do table.remove(drive.pending, 1) end
  drive.run = { asked = asked, replies = { { frame = frame, time = time } } }
  link(asked[#asked], frame, time)
  return true
end

-- Says once, when the frame is first seen, what it is.
local function learn_single(bus, id, frame, time, data, answers)
  local drive = drive_state(bus, id)
  local record = { kind = QUERY, replies = {}, expects = false }
  state.frames[frame] = record
  if not commands[data[1]] then
    drive.run = nil
    return
  end
  take_several(drive, bus, id, time)
  drop_old(drive, time)
  local may_reply, may_ask = answers ~= QUERY, answers ~= REPLY
  local sure = answers == REPLY
  if may_reply and (continue_run(drive, frame, time, data, sure) or start_run(drive, frame, time, data, sure)) then return end
  drive.run = nil
  if not may_ask or (may_reply and is_state(data[1]) and data[2] > 1) then
    record.kind, record.orphan = REPLY, true
    return
  end
  record.expects = format().queries[data[1]] ~= nil
  if record.expects then
    drive.pending[#drive.pending + 1] = { frame = frame, time = time, command = data[1], data = data }
  end
end

local function learn_several(bus, id, frame, time, data)
  state.frames[frame] = { kind = QUERY, replies = {}, expects = format().several[id] ~= nil }
  state.several[#state.several + 1] = { bus = bus, id = id, frame = frame, time = time, data = data }
end

-- What is shown.

local function add_fields(tree, tvb, layout, parameter)
  local said, errors = {}, {}
  for _, one in ipairs(layout) do
    local name, first_bit, bits, is_signed, lsb, only_for = one[1], one[2], one[3], one[4], one[5], one[6]
    if not only_for or only_for == parameter then
      local about = names[name]
      local value = scaled(raw_value(tvb, first_bit, bits, is_signed), lsb)
      local range = tvb(math.floor(first_bit / 8), math.ceil(bits / 8))
      if about.kind == "flag" then
        tree:add(about.field, range, value ~= 0)
        if value ~= 0 then errors[#errors + 1] = about.label end
      else
        local item = tree:add(about.field, range, value)
        item:append_text(unit_text(about))
        said[#said + 1] = about.label .. " " .. words(about, value)
      end
    end
  end
  if #errors > 0 then
    local text = table.concat(errors, ", ")
    tree:add_proto_expert_info(experts.errors, text)
    said[#said + 1] = "ERROR: " .. text
  end
  return table.concat(said, ", ")
end

local function add_pairing(tree, record)
  if record.asked then
    tree:add(meta.reply_to, record.asked.frame):set_generated()
    local s = math.floor(record.delay)
    tree:add(meta.response_time, NSTime.new(s, math.floor((record.delay - s) * 1e9 + 0.5))):set_generated()
  elseif record.orphan then
    tree:add_proto_expert_info(experts.orphan)
  end
  for _, reply in ipairs(record.replies) do tree:add(meta.reply_in, reply):set_generated() end
  -- Nothing is known of what is to come while a capture is read for the first time.
  if record.kind == QUERY and record.expects and #record.replies == 0 and record.complete then
    tree:add_proto_expert_info(experts.unanswered)
  end
end

local function show(tvb, pinfo, tree, title, name, layout, record)
  tree:add(meta.kind, record.kind):set_generated()
  tree:add(meta.command_name, name):set_generated()
  if not layout then
    tree:add_proto_expert_info(experts.unknown)
    pinfo.cols.info = title .. name
    return
  end
  local said = add_fields(tree, tvb, layout, byte(tvb, 1))
  add_pairing(tree, record)
  pinfo.cols.info = title .. name .. (said ~= "" and ": " .. said or "")
end

-- A field of another dissector, which not every version of Wireshark needs to have.
local function field_if_known(name)
  local known, field = pcall(Field.new, name)
  return known and field or function() return nil end
end

local frame_interface = field_if_known("frame.interface_id")
local remote_request = field_if_known("can.flags.rtr")
local can_fd_flag = field_if_known("canfd.flags.brs") -- there in CAN FD frames only

local function dissect_single(tvb, pinfo, tree, id, base_id, record)
  local command = byte(tvb, 0)
  local item = tree:add(meta.command, tvb(0, 1))
  local known = commands[command]
  if known then item:append_text(" (" .. known.name .. ")") end
  local drive = id - base_id
  tree:add(meta.drive, drive):set_generated()
  local reply = record.kind == REPLY
  local layouts_now = reply and format().replies or format().queries
  show(tvb, pinfo, tree, "Drive " .. drive .. (reply and " → " or " ← "),
    known and known.name or string.format("unknown command 0x%02X", command), layouts_now[command], record)
end

function proto.dissector(tvb, pinfo, root)
  local remote = remote_request()
  if (remote and remote.value) or can_fd_flag() then return 0 end -- drives do not look at these
  local id = pinfo.match_uint
  pinfo.cols.protocol = "LK"
  local tree = root:add(proto, tvb())
  if tvb:len() ~= 8 then
    tree:add_proto_expert_info(experts.length)
    pinfo.cols.info = string.format("0x%03X: %d bytes", id, tvb:len())
    return tvb:len()
  end
  local reply_base = proto.prefs.reply_base
  local from_drive = reply_base ~= SINGLE_ID and id > reply_base and id <= reply_base + DRIVES
  local base_id = from_drive and reply_base or SINGLE_ID
  if not pinfo.visited or not state.frames[pinfo.number] then
    local interface = frame_interface()
    local bus = interface and tostring(interface.value) or "0"
    local data = {}
    for n = 1, 8 do data[n] = byte(tvb, n - 1) end
    if several[id] then
      learn_several(bus, id, pinfo.number, pinfo.rel_ts, data)
    else
      local answers = reply_base ~= SINGLE_ID and (from_drive and REPLY or QUERY) or nil
      learn_single(bus, id - base_id, pinfo.number, pinfo.rel_ts, data, answers)
    end
  end
  local record = state.frames[pinfo.number]
  record.complete = pinfo.visited
  if several[id] then
    show(tvb, pinfo, tree, "Drives 1–4 ← ", several[id].name, format().several[id], record)
  else
    dissect_single(tvb, pinfo, tree, id, base_id, record)
  end
  return 8
end

local can_ids = DissectorTable.get("can.id")
local function register(first, last)
  for id = first, last do can_ids:add(id, proto) end
end
register(SINGLE_ID + 1, SINGLE_ID + DRIVES)
for id in pairs(several) do register(id, id) end

local replies_at = SINGLE_ID
function proto.prefs_changed()
  if replies_at == proto.prefs.reply_base then return end
  if replies_at ~= SINGLE_ID then
    for id = replies_at + 1, replies_at + DRIVES do can_ids:remove(id, proto) end
  end
  replies_at = proto.prefs.reply_base
  if replies_at ~= SINGLE_ID then register(replies_at + 1, replies_at + DRIVES) end
end

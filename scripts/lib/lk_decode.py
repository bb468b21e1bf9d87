"""Decodes LK-TECH payloads (generation `legacy`, docs/reference/protocol.md) to words and units."""

import struct

NAMES = {
    0x30: "read PID",
    0x33: "read acceleration",
    0x80: "off",
    0x81: "stop",
    0x90: "read encoder",
    0x92: "read multi-turn angle",
    0x94: "read single-turn angle",
    0x9A: "read state 1",
    0x9C: "read state 2",
    0x9D: "read state 3",
    0xA2: "speed",
    0xA3: "position",
    0xA4: "position",
}
IQ_A = 33 / 2048  # per unit of the wire, in replies
PHASE_A = 1 / 64
ERRORS = {0x01: "under-voltage", 0x08: "motor too hot"}


def angle_deg(payload):
    """Returns the angle of reply 0x92: 56 bits with a sign, in 0.01 degrees."""
    return int.from_bytes(payload[1:8], "little", signed=True) / 100


def state2(payload):
    """Returns temperature in C, torque current in A, speed in degrees/s, encoder."""
    temperature, iq, speed, encoder = struct.unpack("<xbhhH", payload)
    return temperature, iq * IQ_A, speed, encoder


def query_in_words(payload):
    command = payload[0]
    words = f"{command:02X} {NAMES[command]}"
    (value,) = struct.unpack("<4xi", payload)
    if command == 0xA2:
        return f"{words} {value / 100:g} °/s"
    if command == 0xA3:
        return f"{words} {value / 100:g}°"
    if command == 0xA4:
        return f"{words} {value / 100:g}°, at most {payload[2] | payload[3] << 8} °/s"
    return words


def reply_in_words(payload):
    command = payload[0]
    if command == 0x9A:
        temperature, voltage, errors = struct.unpack("<xbxHxxB", payload)
        known = [name for bit, name in ERRORS.items() if errors & bit]
        if errors & ~sum(ERRORS):
            known.append(f"error bits {errors:#04x}")
        return f"{temperature} °C, {voltage / 10} V, {', '.join(known) or 'no error'}"
    if command in (0x9C, 0xA2, 0xA3, 0xA4):
        temperature, iq, speed, encoder = state2(payload)
        return f"{temperature} °C, {iq:.2f} A, {speed} °/s, encoder {encoder}"
    if command == 0x9D:
        temperature, *phases = struct.unpack("<xbhhh", payload)
        return f"{temperature} °C, phases " + " ".join(f"{i * PHASE_A:.2f}" for i in phases) + " A"
    if command == 0x90:
        return "encoder {}, raw {}, offset {}".format(*struct.unpack("<2xHHH", payload))
    if command == 0x92:
        return f"{angle_deg(payload):.2f}°"
    if command == 0x94:
        return "{:.2f}°".format(struct.unpack("<6xH", payload)[0] / 100)
    if command == 0x30:
        return "Kp/Ki: angle {}/{}, speed {}/{}, current {}/{}".format(*payload[2:8])
    if command == 0x33:
        return "{} °/s² (0: no ramp)".format(*struct.unpack("<4xi", payload))
    return "done"  # the replies to 0x80 and 0x81 repeat the query

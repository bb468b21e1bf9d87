"""HTTP requests whose answers are recorded."""

from __future__ import annotations

import re
from typing import Any, Iterator

from .program import Program

FRAMES = "/frames"
DIRECTIVES = "/directives"
ADVANCE = "/clock/advance"

# Name, method, path, body. The order matters: each request changes the state for the next.
REQUESTS: list[tuple[str, str, str, Any]] = [
    ("status_at_start", "GET", "/status", None),
    ("drives_at_start", "GET", "/drives", None),
    ("speed_command", "POST", FRAMES, {"command": "speed", "speed_dps": 360, "ids": "2-5"}),
    ("raw_frame", "POST", FRAMES, {"frame": "146#A400680100C8AF00"}),
    ("unknown_command", "POST", FRAMES, {"command": "fly", "id": 2}),
    ("missing_quantity", "POST", FRAMES, {"command": "torque", "id": 2}),
    ("bad_frame", "POST", FRAMES, {"frame": "142#9"}),
    ("advance", "POST", ADVANCE, {"by_s": 0.05}),
    ("advance_back", "POST", ADVANCE, {"to_s": 0.01}),
    ("advance_by_text", "POST", ADVANCE, {"by_s": "soon"}),
    ("advance_both", "POST", ADVANCE, {"by_s": 1, "to_s": 2}),
    ("supply", "POST", DIRECTIVES, {"supply_V": 18, "ramp_s": 0.02, "ids": "2-3"}),
    ("sag", "POST", DIRECTIVES, {"sag_to_V": 14, "sag_s": 0.05, "id": 4}),
    ("ambient", "POST", DIRECTIVES, {"ambient_C": 40}),
    ("load", "POST", DIRECTIVES, {"load": {"J_g_cm2": 2000, "tau_Nm": 0.1}, "id": 5}),
    ("turn", "POST", DIRECTIVES, {"turn_deg": 5, "id": 6}),
    ("settings", "POST", DIRECTIVES, {"settings": {"max_speed_dps": 360, "gains": {"angle_kp": 90}}, "id": 2}),
    ("settings_of_two", "POST", DIRECTIVES, {"settings": {"protection": {"stall": {"enabled": True}}}, "ids": "2,4"}),
    ("mark", "POST", DIRECTIVES, {"mark": "here"}),
    ("planned", "POST", DIRECTIVES, {"power": "cycle", "off_s": 0.1, "id": 3, "at_s": 3}),
    ("conditional", "POST", DIRECTIVES,
     {"when": {"id": 2, "signal": "speed_dps", "above": 200}, "fault": {"kind": "drop", "probability": 0.5}, "id": 2}),
    ("fault", "POST", DIRECTIVES, {"fault": {"kind": "encoder_jump", "angle_deg": 15}, "id": 3}),
    ("fault_by_word", "POST", DIRECTIVES, {"fault": "jam", "id": 5}),
    ("fault_of_the_bus", "POST", DIRECTIVES, {"fault": {"kind": "adapter_latency", "tx_us": 300, "rx_us": 500}}),
    ("fault_for_a_time", "POST", DIRECTIVES, {"fault": {"kind": "delay", "delay_ms": 2, "for_s": 0.05}, "ids": "2-4"}),
    ("fault_without_parameter", "POST", DIRECTIVES, {"fault": "encoder_jump", "id": 3}),
    ("fault_out_of_range", "POST", DIRECTIVES, {"fault": {"kind": "jam", "percent": 101}, "id": 3}),
    ("unknown_fault", "POST", DIRECTIVES, {"fault": "gremlins"}),
    ("unknown_drive", "POST", DIRECTIVES, {"power": "off", "id": 9}),
    ("unknown_bus", "POST", DIRECTIVES, {"power": "off", "bus": "other"}),
    ("unknown_key", "POST", DIRECTIVES, {"colour": "red"}),
    ("two_actions", "POST", DIRECTIVES, {"power": "off", "supply_V": 12}),
    ("no_action", "POST", DIRECTIVES, {"id": 2}),
    ("supply_out_of_range", "POST", DIRECTIVES, {"supply_V": 101}),
    ("clear_of_nothing", "POST", DIRECTIVES, {"clear": "no_such_fault"}),
    ("no_json", "POST", DIRECTIVES, "{"),
    ("key_twice", "POST", DIRECTIVES, '{"id": 2, "id": 3, "power": "off"}'),
    ("faults", "GET", "/faults", None),
    ("advance_with_faults", "POST", ADVANCE, {"to_s": 0.2}),
    ("drives_with_faults", "GET", "/drives", None),
    ("faults_with_effects", "GET", "/faults", None),
    ("clear_one_kind", "POST", DIRECTIVES, {"clear": "jam"}),
    ("clear_all", "POST", DIRECTIVES, {"clear": "all"}),
    ("clear_planned", "DELETE", DIRECTIVES, None),
    ("clock", "PUT", "/clock", {"mode": "x10000"}),
    ("clock_by_number", "PUT", "/clock", {"mode": 1}),
    ("clock_stepped_again", "PUT", "/clock", {"mode": "stepped"}),
    ("stop_no_advance", "DELETE", ADVANCE, None),
    ("stop_no_recording", "DELETE", "/recording", None),
    ("no_scenario", "GET", "/scenario", None),
    ("stop_no_scenario", "DELETE", "/scenario", None),
    ("scenario_without_text", "POST", "/scenario", {}),
    ("scenario_misread", "POST", "/scenario", {"toml": "duration_s = true"}),
    ("scenario", "POST", "/scenario", {"toml": """
robot = "bench"
duration_s = 0.5
[[event]]
at_s = 0.1
id = 2
fault = { kind = "silent", for_s = 0.1 }
[[send]]
at_s = 0.05
every_s = 0.02
id = 2
command = "state_2"
[[expect]]
says = "it answers"
id = 2
answered = { within_s = 0.02 }
[[expect]]
says = "it is not hot"
id = 2
signal = "temperature_C"
max = 40
"""}),
    ("scenario_twice", "POST", "/scenario", {"toml": "robot = \"bench\"\nduration_s = 1"}),
    ("advance_into_the_scenario", "POST", ADVANCE, {"by_s": 0.3}),
    ("verdict_so_far", "GET", "/scenario", None),
    ("advance_past_the_scenario", "POST", ADVANCE, {"by_s": 0.4}),
    ("verdict", "GET", "/scenario", None),
    ("off_then_motion", "POST", FRAMES, {"command": "off", "id": 2}),
    ("motion_while_off", "POST", FRAMES, {"command": "torque", "iq_A": 1, "id": 2}),
    ("beyond_the_field", "POST", FRAMES, {"frame": "142#A10000000F270000"}),
    ("no_such_command", "POST", FRAMES, {"frame": "142#FF00000000000000"}),
    ("advance_for_advice", "POST", ADVANCE, {"by_s": 0.1}),
    ("no_such_path", "GET", "/nothing", None),
    ("wrong_method", "PUT", "/status", {}),
    ("no_such_drive", "GET", "/drives/other/1", None),
]
GET_PATHS = (
    "/advice", "/body", "/clock", "/drives", "/drives/{bus}/{id}", "/faults", "/faults/kinds", "/frames", "/scenario", "/scenarios",
    "/signals", "/status", "/telemetry",
)  # fmt: skip


def get_paths(bus: str) -> Iterator[tuple[str, str]]:
    """Yields item name and path of every GET, with each drive's ID where the path has one."""
    for path in GET_PATHS:
        for drive in range(1, 7) if "{id}" in path else [0]:
            name = re.sub(r"\W+", "_", path.replace("{bus}/{id}", str(drive)).strip("/"))
            yield name, path.format(bus=bus, id=drive)


def streams(program: Program) -> Iterator[tuple[str, Any]]:
    """Yields 20 ms of both WebSockets. Frames are collected: their number per message depends on real time."""
    telemetry = program.listen("/telemetry?signals=speed_dps,iq_A,true_angle_deg&ids=2-4&rate_Hz=500")
    frames = program.listen("/frames")
    introductions = [telemetry.receive(), frames.receive()]
    program.asked("POST", FRAMES, {"command": "position_2", "angle_deg": 90, "max_speed_dps": 360, "ids": "2-5"})
    program.advance(20)
    samples = [telemetry.receive() for _ in range(10)]
    seen: list[Any] = []
    while len(seen) < 8:
        seen += frames.receive()["frames"]
    telemetry.close()
    frames.close()
    yield "stream_telemetry", [introductions[0], samples]
    for frame in seen:
        frame.pop("advice", None)  # depends on real time
    yield "stream_frames", [introductions[1], seen]

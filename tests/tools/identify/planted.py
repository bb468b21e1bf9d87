#!/usr/bin/python3
"""Makes logs of planted motors, whose parameters are random but known.

The script of --plan is the host; lk-emu with a stepped clock is the motor. The recording is the log, with true times.

usage: planted.py FIRST LAST DIRECTORY   writes DIRECTORY/N.log and N.json for the seeds

docs/pictures/identify.svg is the first picture of this report:
    lk-emu identify 1.log --motor mf7015 --generation v235 --report 1.html
"""

import contextlib
import io
import json
import math
import os
import random
import sys
import tempfile
import types

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
sys.path.insert(0, os.path.join(ROOT, "python"))

import lkemu  # noqa: E402
from lkemu.identify.motor import load_motor  # noqa: E402
from lkemu.identify.plan import write_plan  # noqa: E402

MOTORS = ("mg4005", "mf7015", "mg5010", "mf9025", "mg6010")
ORDERS = (12, 14, 20, 26, 28, 40, 42)


class Planted:
    """A shipped motor with random parameters."""

    def __init__(self, seed):
        draw = random.Random(seed)

        def times(low, high):
            return math.exp(draw.uniform(math.log(low), math.log(high)))

        self.seed, self.motor = seed, draw.choice(MOTORS)
        self.base = load_motor(self.motor)
        mechanics, sensor = dict(self.base.data["mechanics"]), dict(self.base.data["current_sensor"])
        mechanics["J_g_cm2"] *= times(0.6, 4)
        friction = times(0.6, 1.6)
        mechanics["tau_coulomb_mNm"] *= friction
        mechanics["tau_static_mNm"] *= friction
        mechanics["B_uNm_s_rad"] = draw.uniform(0.5, 8) * mechanics["tau_coulomb_mNm"]
        mechanics["tau_cogging_mNm"] = mechanics["tau_coulomb_mNm"] * draw.uniform(0.1, 0.5)
        # Not the pole pairs: current offsets act at that order.
        mechanics["cogging_per_turn"] = draw.choice([n for n in ORDERS if n != self.base.pole_pairs])
        sensor["noise_A"] = draw.uniform(0.02, 0.08)
        sensor["offset_a_A"], sensor["offset_b_A"] = draw.uniform(-0.03, 0.03), draw.uniform(-0.03, 0.03)
        self.profile = {
            "mechanics": mechanics,
            "current_sensor": sensor,
            "encoder": {"noise_deg": draw.uniform(0.001, 0.004)},
            "control": dict(self.base.data["control"]),
        }
        self.drive = {"boot_angle_deg": draw.uniform(-180, 180)}
        self.rate_Hz = draw.uniform(100, 300)
        self.random = random.Random(seed + 1000)

    def truth(self):
        """True values by the keys of identify."""
        m, base = self.profile["mechanics"], self.base
        out = m["J_out_g_cm2"] + self.drive.get("load", {}).get("J_g_cm2", 0)
        loops = base.loops()
        return {
            "inertia_A_s2_rad": (m["J_g_cm2"] + out / base.N**2) * 1e-7 / base.k_t,
            "coulomb_A": (m["tau_coulomb_mNm"] + m["tau_coulomb_out_mNm"] / base.N / base.efficiency) * 1e-3 / base.k_t,
            "viscous_A_s_rad": m["B_uNm_s_rad"] * 1e-6 / base.k_t,
            "cogging_A": m["tau_cogging_mNm"] * 1e-3 / base.k_t,
            "cogging_order": m["cogging_per_turn"],
            "speed_kp_A_s_rad": loops["speed_kp"],
            "speed_ki_A_rad": loops["speed_ki"],
            "angle_kp_per_s": loops["angle_kp"],
        }

    def robot(self, interface):
        def value(one):
            if isinstance(one, dict):
                return "{ " + ", ".join(f"{key} = {value(v)}" for key, v in one.items()) + " }"
            return json.dumps(one)

        lines = ["[[bus]]", f"interface = {json.dumps(interface)}", "[[bus.drive]]", "id = 1",
                 f"motor = {json.dumps(self.motor)}", 'generation = "v235"']  # fmt: skip
        lines += [f"{key} = {value(one)}" for key, one in self.drive.items()]
        for section, keys in self.profile.items():
            lines += [f"profile.{section}.{key} = {value(one)}" for key, one in keys.items()]
        return "\n".join(lines) + "\n"


class SteppedTime:
    """Replaces the module `time`; sleeps have jitter like those of a real host."""

    def __init__(self, clock, jitter, random):
        self.clock, self.now, self.jitter, self.random = clock, 0.0, jitter, random

    def monotonic(self):
        return self.now

    time = monotonic

    def sleep(self, seconds):
        self.advance(max(0.0, seconds + self.random.uniform(-1, 1) * self.jitter))

    def advance(self, seconds):
        if seconds >= 1e-6:
            self.now = self.clock.advance(seconds)


class SlcanHost:
    """A can.Bus on an slcan terminal."""

    def __init__(self, path, time):
        self.file, self.time, self.text = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY), time, b""
        os.write(self.file, b"S8\rO\r")

    def send(self, message):
        os.write(self.file, b"t%03X8%s\r" % (message.arbitration_id, bytes(message.data).hex().upper().encode()))

    def recv(self, timeout):
        end = self.time.now + timeout
        while self.time.now < end:
            self.time.advance(0.5e-3)
            with contextlib.suppress(BlockingIOError):
                self.text += os.read(self.file, 4096)
            *lines, self.text = self.text.split(b"\r")
            for line in lines:
                line = line.lstrip(b"\x07zZ")
                if line.startswith(b"t"):
                    return types.SimpleNamespace(arbitration_id=int(line[1:4], 16), data=bytes.fromhex(line[5:21].decode()),
                                                 is_error_frame=False, timestamp=self.time.now)  # fmt: skip
        return None


def script_of(motor, generation="v235"):
    return write_plan(load_motor(motor), motor, 1, generation)[0]


def frames(planted, script, steps=None, jitter=0.2, rate_Hz=None):
    """Runs the script; returns [(seconds, "141#…", is_query)]. `steps` replaces its steps, without its limits."""
    script = script.replace("import can\n", "")
    space = {"__name__": "excite"}
    exec(compile(script, "excite.py", "exec"), space)
    rate = rate_Hz or planted.rate_Hz
    with tempfile.TemporaryDirectory() as folder:
        terminal, robot, record = (os.path.join(folder, name) for name in ("can", "robot.toml", "record"))
        with open(robot, "w", encoding="utf-8") as file:
            file.write(planted.robot("slcan-pty:" + terminal))
        with lkemu.Emulator(config=robot, clock="stepped", seed=planted.seed, record=record) as emulator:
            time = SteppedTime(emulator.clock, jitter / rate, planted.random)
            time.advance(0.2)
            space["can"] = types.SimpleNamespace(
                Message=lambda arbitration_id, data, is_extended_id: types.SimpleNamespace(
                    arbitration_id=arbitration_id, data=data))  # fmt: skip
            space.update(time=time, RATE_HZ=rate)
            if steps:
                space.update(STEPS=steps, PULSE_DPS=1e9, MOST_DPS=1e9, TRAVEL_TURNS=1e9)
            with contextlib.redirect_stderr(io.StringIO()):
                space["run"](SlcanHost(terminal, time), io.StringIO())
        with open(os.path.join(record, "frames.log"), encoding="ascii") as file:
            return [(float(at[1:-1]), frame, whose == "T") for at, _, frame, whose in map(str.split, file)]


def log_text(frames, random, loss=0.01, query_early_s=(-20e-6, 20e-6), reply_late_s=(-20e-6, 20e-6), shift_s=1.0):
    """Log as by candump -L, with lost lines and stamp errors, in the order of the host."""
    lines = []
    for at, frame, is_query in frames:
        if random.random() < loss:
            continue
        off = -random.uniform(*query_early_s) if is_query else random.uniform(*reply_late_s)
        lines.append(f"({at + off + shift_s:.6f}) can0 {frame}")
    return "\n".join(lines) + "\n"


def main():
    first, last, directory = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    os.makedirs(directory, exist_ok=True)
    scripts = {}
    for seed in range(first, last + 1):
        if os.path.exists(os.path.join(directory, f"{seed}.json")):
            continue
        planted = Planted(seed)
        if planted.motor not in scripts:
            scripts[planted.motor] = script_of(planted.motor)
        made = frames(planted, scripts[planted.motor])
        with open(os.path.join(directory, f"{seed}.json"), "w", encoding="utf-8") as file:
            json.dump({"motor": planted.motor, "truth": planted.truth(), "frames": made}, file)
        with open(os.path.join(directory, f"{seed}.log"), "w", encoding="ascii") as file:
            file.write(log_text(made, random.Random(seed)))


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Soak test: 32 live drives with hosts that send random frames and faults that come and go.

usage: scripts/with-vcan bench/soak.py [LK_EMU [SECONDS [SEED]]]

Three hosts on vcan0 send random commands, valid and invalid; faults and supplies change through the control interface.
At the end all counters must add up, and simulated plus slipped time must equal the elapsed time. Every signal of every
drive must be finite, and memory must not have grown. Exit status 0: passed; 1: failed, one line gives the reason.
"""

import http.client
import json
import os
import random
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time

IDS = 32
HOSTS = 3
MOST_FAULTS = 900  # a bus keeps 1000
MOST_MEMORY_KB = 2048  # after warm-up: memory of a thousand faults plus slack of the allocator
MOST_LAG_S = 0.051  # lag that the emulator makes up before time slips
COMMANDS = bytes.fromhex("1930313233348081889091929495 9A9B9C9D A0A1A2A3A4A5A6A7A8 8CC0C1".replace(" ", ""))


class Control(http.client.HTTPConnection):
    """HTTP requests over the Unix socket at `path`."""

    def __init__(self, path):
        super().__init__("localhost", timeout=30)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)

    def ask(self, method, path, body=None):
        headers = {"Content-Type": "application/json"} if body else {}
        self.request(method, "/api/v1" + path, json.dumps(body) if body else None, headers)
        answer = self.getresponse()
        return answer.status, json.loads(answer.read() or "null")

    def get(self, path):
        status, answer = self.ask("GET", path)
        assert status == 200, f"{path}: {status} {answer}"
        return answer


CAN_RAW_ERR_FILTER = 2  # linux/can/raw.h; Python's module has it on some builds only


def can_socket(interface="vcan0"):
    bus = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    bus.setsockopt(socket.SOL_CAN_RAW, CAN_RAW_ERR_FILTER, 0x1FFFFFFF)
    bus.bind((interface,))
    return bus


class Traffic:
    """Hosts that send, and a monitor that counts all frames on the bus."""

    def __init__(self, dice):
        self.dice = dice
        self.hosts = [can_socket() for _ in range(HOSTS)]
        for host in self.hosts:
            host.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"")  # they only send
        self.monitor = can_socket()
        self.monitor.setsockopt(socket.SOL_SOCKET, 33, 8 << 20)  # SO_RCVBUFFORCE
        self.monitor.setblocking(False)
        self.sent = self.seen = 0

    def frame(self):
        dice = self.dice
        identifier, length = 0x140 + dice.randint(1, IDS), 8
        data = bytes([dice.choice(COMMANDS)]) + bytes(dice.choice((0, dice.randrange(256))) for _ in range(7))
        chance = dice.random()
        if chance < 0.02:
            length = dice.randrange(8)
        elif chance < 0.04:
            identifier = dice.randrange(0x800)
        elif chance < 0.05:
            identifier |= socket.CAN_EFF_FLAG
        elif chance < 0.06:
            data = bytes([dice.randrange(256)]) + data[1:]
        return struct.pack("<IB3x8s", identifier, length, data)

    def send(self, count):
        for _ in range(count):
            self.dice.choice(self.hosts).send(self.frame())
            self.sent += 1
        self.look()

    def look(self):
        while True:
            try:
                self.monitor.recv(16)
            except BlockingIOError:
                return
            self.seen += 1


def random_fault(dice, kind):
    fault = {"kind": kind["kind"]}
    for parameter in kind["parameters"]:
        if "choices" in parameter:
            fault[parameter["name"]] = dice.choice(parameter["choices"])
        elif parameter["required"]:
            low, high = parameter["min"], parameter["max"]
            fault[parameter["name"]] = min(max(dice.uniform(low, high) / 1000, low), high)
    if kind["per_frame"]:
        fault["probability"] = dice.uniform(0.05, 1)
    if not kind["momentary"]:
        fault["for_s"] = dice.uniform(0.001, 0.2 if kind["of_bus"] else 3)
    return fault


def directive(dice, kinds, faults_left):
    body = {"ids": ",".join(str(n) for n in sorted(dice.sample(range(1, IDS + 1), dice.randint(1, 4))))}
    choice = dice.randrange(10)
    if choice < 5 and faults_left > 0:
        kind = dice.choice(kinds)
        if kind["of_bus"]:
            del body["ids"]
        body["fault"] = random_fault(dice, kind)
    elif choice < 7:
        body["power"] = dice.choice(("on", "on", "cycle"))
    elif choice < 8:
        body["supply_V"] = dice.uniform(18, 30)
        body["ramp_s"] = dice.random()
    elif choice < 9:
        body["load"] = {"tau_Nm": dice.uniform(-0.5, 0.5)}
    else:
        body["sag_to_V"] = dice.uniform(4, 24)
        body["sag_s"] = dice.uniform(0.01, 1)
    return body


def memory_kb(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))


class Clock:
    """A reading of simulated and slipped time, between two readings of monotonic time."""

    def __init__(self, control):
        self.before = time.monotonic()
        answer = control.get("/clock")
        self.after = time.monotonic()
        self.slipped = answer["slipped_s"]
        self.total = answer["time_s"] + self.slipped


def not_finite(drives):
    """Returns the first signal that is not finite (null in JSON), or None."""
    for drive in drives:
        for name, value in drive["signals"].items():
            if value is None:
                return f"{name} of drive {drive['id']} is not finite"
    return None


def settled(control):
    """Returns the counters once no frame is pending."""
    last = None
    while True:
        bus = control.get("/status")["buses"][0]["counters"]
        moves = {key: value for key, value in bus.items() if key != "wire_busy_s"}
        on_the_way = bus["frames_waiting"] + bus["replies_waiting"] + bus["interface"]["pending"]
        if on_the_way + bus["rom_gate"]["waiting"] == 0 and moves == last:
            return bus
        last = moves
        select.select([], [], [], 0.1)


def complaints(bus, drives, traffic, begin, end, memory):
    dropped = sum(bus["dropped"].values())
    accepted = sum(drive["counters"]["queries"] for drive in drives)
    given = sum(drive["counters"]["replies"] for drive in drives)
    port = bus["interface"]
    left = (port["sent"] + port["lost_link_down"] + port["lost_queue_full"] + bus["rom_gate"]["lost_replies"])
    shortest, longest = end.before - begin.after, end.after - begin.before
    passed = end.total - begin.total
    sums = [
        ("hosts' frames", traffic.sent, bus["frames"] + port["kernel_drops"]),
        ("frames", bus["frames"], bus["queries"] + dropped),
        ("queries that drives accepted and their answers", accepted, given),
        ("replies", given + bus["extra_frames"], bus["replies"] + bus["replies_lost"]),
        ("replies and the interface", bus["replies"] + bus["error_frames"], left),
        ("frames seen on the bus", traffic.seen, traffic.sent + port["sent"]),
    ]
    for what, one, other in sums:
        if one != other:
            yield f"{what} do not add up: {one} and {other}"
    if not shortest - MOST_LAG_S <= passed <= longest + MOST_LAG_S:
        yield f"{passed:.3f} s of simulated and slipped time in {shortest:.3f} to {longest:.3f} s"
    if memory[1] > memory[0] + MOST_MEMORY_KB:
        yield f"memory grew from {memory[0]} to {memory[1]} kB"
    if not_finite(drives):
        yield not_finite(drives)


def wake_all(control):
    """Clears all faults and powers all drives, so that the last frames are answered or counted."""
    control.ask("POST", "/directives", {"clear": "all"})
    control.ask("POST", "/directives", {"power": "on"})


def main(program="build/release/emulator/lk-emu", seconds="600", seed="1"):
    dice, seconds = random.Random(int(seed)), float(seconds)
    directory = tempfile.TemporaryDirectory(prefix="lk-soak-")
    path = os.path.join(directory.name, "s")
    emulator = subprocess.Popen(
        [program, "--bus", "vcan0", "--ids", f"1-{IDS}", "--control", path, "--rom", directory.name, "--log-level", "off"],
        stdout=subprocess.PIPE,
        text=True,
    )
    emulator.stdout.readline()
    control, traffic = Control(path), Traffic(dice)
    kinds = control.get("/faults/kinds")
    begin, memory, faults, refused, checks = Clock(control), [None, 0], 0, 0, 0
    begun = time.monotonic()
    # A slow machine runs longer, until it has had enough faults and checks.
    while (elapsed := time.monotonic() - begun) < seconds or faults < 5 or checks == 0:
        traffic.send(dice.choice((1, 5, 20, 200)) if dice.random() < 0.05 else 3)
        if dice.random() < 0.05:
            body = directive(dice, kinds, max(5, MOST_FAULTS * elapsed / seconds) - faults)
            status, answer = control.ask("POST", "/directives", body)
            assert status in (200, 400, 409), f"{body}: {status} {answer}"
            refused += status != 200
            faults += "fault" in body and status == 200
        if dice.random() < 0.01:
            checks += 1
            wrong = not_finite(control.get("/drives"))
            if wrong:
                sys.exit(f"soak: {wrong} after {elapsed:.1f} s")
        if memory[0] is None and elapsed > seconds / 10:
            memory[0] = memory_kb(emulator.pid)
        select.select([traffic.monitor], [], [], 0.002)
        traffic.look()
    wake_all(control)
    bus = settled(control)
    traffic.look()
    end, drives = Clock(control), control.get("/drives")
    memory[1] = memory_kb(emulator.pid)
    dropped = {cause: count for cause, count in bus["dropped"].items() if count}
    print(f"{end.before - begin.before:.1f} s, of which {end.slipped - begin.slipped:.3f} slipped; drift "
          f"{1e3 * (end.total - begin.total - (end.before + end.after - begin.before - begin.after) / 2):.1f} ms")
    print(f"{traffic.sent} frames of hosts = {bus['queries']} queries + {sum(dropped.values())} not answered {dropped}"
          f" + {bus['interface']['kernel_drops']} dropped by the kernel")
    print(f"{traffic.seen - traffic.sent} frames of drives, {bus['replies_lost']} lost, {bus['extra_frames']} unrequested,"
          f" {bus['error_frames']} error frames; {bus['rom_writes']} writes to ROM")
    print(f"{faults} faults, {refused} directives refused; {checks} looks at all states; memory {memory[0]} kB, in the end {memory[1]} kB")
    emulator.terminate()
    emulator.communicate()
    wrong = list(complaints(bus, drives, traffic, begin, end, memory))
    if refused > faults:
        wrong.append(f"{refused} directives were refused, {faults} faults set")
    if emulator.returncode != 0:
        wrong.append(f"lk-emu ended with status {emulator.returncode}")
    for line in wrong:
        print("soak: " + line)
    directory.cleanup()
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

#!/usr/bin/python3
"""can-utils' slcand as a host of lk-emu: it makes an interface of the kernel of a terminal that speaks slcan, and
python-can asks the drives through that.

usage: slcand_host.py LK_EMU   (as root, see scripts/with-vcan; where there is no slcan in the kernel it says so and ends)
"""

import glob
import os
import subprocess
import sys
import tempfile
import time

import can

PATIENCE_S = 20.0
NO_SLCAN = 77  # the test is skipped


def load_slcan() -> bool:
    modules = glob.glob(f"/usr/lib/uml/modules/{os.uname().release}/**/slcan.ko", recursive=True)
    load = ["insmod", modules[0]] if modules else ["modprobe", "slcan"]
    return subprocess.run(load, check=False).returncode == 0


def wait_for(what) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def main(program: str) -> int:
    if not load_slcan():
        print("no slcan in this kernel")
        return NO_SLCAN
    with tempfile.TemporaryDirectory() as directory:
        path = os.path.join(directory, "ttyACM0")
        emulator = subprocess.Popen([program, "--bus", f"slcan-pty:{path}", "--ids", "1-4", "--rom", ":memory:"],
                                    stdout=subprocess.PIPE, text=True)
        try:
            assert emulator.stdout.readline() == f"lk-emu ready slcan-pty:{path}:1-4\n"
            subprocess.run(["slcand", "-o", "-s8", os.readlink(path), "slcan0"], check=True)  # it goes on by itself
            wait_for(lambda: os.path.exists("/sys/class/net/slcan0"))
            subprocess.run(["ip", "link", "set", "slcan0", "up"], check=True)
            with can.Bus(interface="socketcan", channel="slcan0") as bus:
                for n in range(200):
                    motor = 1 + n % 4
                    bus.send(can.Message(arbitration_id=0x140 + motor, data=b"\x9A" + bytes(7), is_extended_id=False))
                    reply = bus.recv(PATIENCE_S)
                    assert reply is not None and reply.arbitration_id == 0x140 + motor and reply.data[0] == 0x9A, reply
        finally:
            emulator.terminate()
            summary = emulator.communicate()[0]
    assert emulator.returncode == 0 and "200 queries, 200 replies" in summary, summary
    print("slcand host: good")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))

"""Runs two with-vcan at a time. Neither may treat the other's control socket as that of a dead program.

    two_machines.py WITH_VCAN LK_EMU
"""

import os
import subprocess
import sys

WITH_VCAN, LK_EMU = sys.argv[1:]
# Shell script for the inside: reports when the drives are up, and continues on request.
RUN = """
for n in 1 2 3 4 5 6 7 8; do : & wait $!; done  # process numbers that the other machine does not have
mkfifo "$0"; "$LK_EMU" --rom :memory: --bus vcan0 --ids 1 >"$0" & exec 3<"$0"; rm "$0"
read -r said <&3; echo "$said"
read -r go
"$LK_EMU" ctl status
kill $!; wait $!
"""


def machine(name, commands):
    environment = {key: value for key, value in os.environ.items() if key != "XDG_RUNTIME_DIR"}
    fifo = f"/dev/shm/{name}-{os.getpid()}"
    return subprocess.Popen(
        [WITH_VCAN, "sh", "-c", commands, fifo],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**environment, "LK_EMU": LK_EMU},
    )


first = machine("first", RUN)
up = first.stdout.readline()
assert up == "lk-emu ready vcan0:1\n", up
second = machine("second", RUN.replace("5 6 7 8", ""))
up = second.stdout.readline()
assert up == "lk-emu ready vcan0:1\n", up
for one in (second, first):
    said, _ = one.communicate("go\n", timeout=120)
    assert one.returncode == 0 and "vcan0" in said, (one.returncode, said)
print("both programs were found, each in its own machine")

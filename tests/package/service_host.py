#!/usr/bin/python3
"""Runs the program as its systemd unit does: as an unprivileged user without capabilities, with NOTIFY_SOCKET.

usage: service_host.py LK_EMU UNIT CONFIGS
"""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile

PATIENCE_S = 20.0
NOBODY = 65534
PLACE = (f"127.{64 + (os.getpid() >> 16)}.{os.getpid() >> 8 & 255}.{os.getpid() & 255}", 29536)  # unique to this process
BUS = "slcan-tcp:{}:{}".format(*PLACE)
CONFIG = f'[[bus]]\ninterface = "{BUS}"\n[[bus.drive]]\nids = "1-4"\n'


def as_nobody():
    """Returns a launcher without capabilities for an unprivileged user, or for this user if no other is mapped."""
    launcher = ["setpriv", "--bounding-set=-all", "--inh-caps=-all", "--ambient-caps=-all", "--no-new-privs"]
    other = ["--reuid", str(NOBODY), "--regid", str(NOBODY), "--clear-groups"]
    if subprocess.run(["setpriv", *other, "true"], stderr=subprocess.DEVNULL, check=False).returncode == 0:
        return [*launcher, *other], NOBODY
    return launcher, os.geteuid()


def command_of(unit, directory):
    """Returns ExecStart for an instance named arm, with all its directories below `directory`."""
    with open(unit, encoding="utf-8") as file:
        line = re.search(r"^ExecStart=(.+)$", file.read(), re.MULTILINE)[1]
    for what, by in {"%S": f"{directory}/state", "%t": f"{directory}/run", "%i": "arm", "/etc/": f"{directory}/etc/",
                     "$LKEMU_OPTIONS": f"--http 127.0.0.1:0 --http-token {directory}/credentials/token"}.items():
        assert what in line, (what, line)
        line = line.replace(what, by)
    return line.split()


def ask(data):
    with socket.create_connection(PLACE, PATIENCE_S) as bus, bus.makefile("rb") as lines:
        bus.sendall(b"O\rt1418" + data.hex().upper().encode() + b"\r")
        said = b""
        while not said.endswith(b"\r") or b"t1418" not in said:  # the acknowledgements come first
            said += lines.read(1)
    return bytes.fromhex(said[said.index(b"t1418") + 5:-1].decode())


def check(program, unit, configs, directory):
    # A copy, since the unprivileged user may lack access to the build directory.
    command = command_of(unit, directory)
    command[0] = shutil.copy(program, os.path.join(os.makedirs(f"{directory}/bin") or f"{directory}/bin", "lk-emu"))
    shutil.copytree(configs, f"{directory}/share/lk-emu")
    launcher, user = as_nobody()
    os.makedirs(f"{directory}/etc/lk-emu")
    with open(f"{directory}/etc/lk-emu/arm.toml", "w", encoding="utf-8") as file:
        file.write(CONFIG)
    for name in ("state", "run"):
        os.makedirs(f"{directory}/{name}/lk-emu/arm", 0o755)
        os.chmod(f"{directory}/{name}/lk-emu/arm", 0o700)
        os.chown(f"{directory}/{name}/lk-emu/arm", user, user)

    # Readable by others, as with systemd's access control list.
    os.makedirs(f"{directory}/credentials")
    with open(f"{directory}/credentials/token", "w", encoding="utf-8") as file:
        file.write("0123456789abcdef\n")

    manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    manager.bind(f"{directory}/notify")
    os.chmod(f"{directory}/notify", 0o777)
    manager.settimeout(PATIENCE_S)
    environment = {"PATH": os.environ["PATH"], "NOTIFY_SOCKET": f"{directory}/notify",
                   "CREDENTIALS_DIRECTORY": f"{directory}/credentials"}
    service = subprocess.Popen([*launcher, *command], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        assert manager.recv(1000) == f"READY=1\nSTATUS=ready {BUS}:1-4".encode()
        with open(f"/proc/{service.pid}/status", encoding="utf-8") as file:
            status = dict(re.findall(r"^(\w+):\s*(.*)$", file.read(), re.MULTILINE))
        for capabilities in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"):
            assert int(status[capabilities], 16) == 0, (capabilities, status[capabilities])
        assert status["NoNewPrivs"] == "1" and status["Uid"].split() == [str(user)] * 4, status["Uid"]
        assert ask(bytes([0x9A, 0, 0, 0, 0, 0, 0, 0]))[0] == 0x9A
        # 0x91 writes an encoder offset to ROM, and is acknowledged once it is on disk.
        assert ask(bytes([0x91, 0, 0, 0, 0, 0, 0x34, 0x12]))[0] == 0x91
        rom = f"{directory}/state/lk-emu/arm/{BUS}-1.toml"
        assert "encoder_offset = 4660" in open(rom, encoding="utf-8").read()
        assert os.stat(rom).st_uid == user
        told = subprocess.run([command[0], "ctl", "--socket", f"{directory}/run/lk-emu/arm/control.sock", "drives"],
                              stdout=subprocess.PIPE, text=True, timeout=PATIENCE_S, check=True).stdout
        assert len(re.findall(r"^\s*\S*slcan-tcp|^\s*[1-4] ", told, re.MULTILINE)) >= 4, told
        service.send_signal(signal.SIGTERM)
        assert manager.recv(1000) == b"STOPPING=1"
        out, err = service.communicate(timeout=PATIENCE_S)
        assert service.returncode == 0 and b"lk-emu stopped after" in out, (service.returncode, out, err)
        assert not os.path.exists(f"{directory}/run/lk-emu/arm/control.sock")
    finally:
        service.kill()
        print(service.communicate()[1].decode(), end="")


def main():
    directory = tempfile.mkdtemp()
    os.chmod(directory, 0o755)
    try:
        check(*sys.argv[1:4], directory)
    finally:
        shutil.rmtree(directory)
    print("service: good")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""A host outside a container with lk-emu's unchanged image. It turns a motor and loads the dashboard.

usage: container_host.py IMAGE PODMAN [OPTION...]   (python-can: Debian's python3-can)
"""

import json
import socket
import struct
import subprocess
import sys
import time
import urllib.error
import urllib.request

import can

PATIENCE_S = 60.0


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def turn(port):
    with can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{port}", sleep_after_open=0) as bus:
        def ask(*data):
            bus.send(can.Message(arbitration_id=0x141, data=bytes(data).ljust(8, b"\0"), is_extended_id=False))
            reply = bus.recv(PATIENCE_S)
            assert reply is not None and reply.arbitration_id == 0x141 and reply.data[0] == data[0], reply
            return reply.data

        ask(0xA2, *struct.pack("<xxxi", 36000))  # 360 degrees per second
        deadline = time.monotonic() + PATIENCE_S
        while struct.unpack_from("<h", ask(0x9C), 4)[0] < 300:
            assert time.monotonic() < deadline, "it does not turn"


def get(port, path, **headers):
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers=headers)
    with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
        return answer.read()


def look(port):
    assert b"<title>" in get(port, "/"), "no dashboard"
    drives = json.loads(get(port, "/api/v1/drives"))
    speeds = {drive["id"]: drive["signals"]["speed_dps"] for drive in drives}
    assert speeds[1] > 300 and abs(speeds[2]) < 10, speeds
    try:
        get(port, "/api/v1/status", Origin="http://example.com")
    except urllib.error.HTTPError as refused:
        assert refused.code == 403, refused
    else:
        raise AssertionError("a foreign page was let in")


def main(image, *podman):
    bus, http = free_port(), free_port()
    command = [*podman, "run", "--rm", "-p", f"127.0.0.1:{bus}:29536", "-p", f"127.0.0.1:{http}:8474", image]
    print(*command, flush=True)
    container = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
    try:
        ready = container.stdout.readline()
        assert ready == "lk-emu ready slcan-tcp:0.0.0.0:29536:1-4\n", ready
        turn(bus)
        look(http)
    finally:
        container.terminate()
        said, _ = container.communicate(timeout=PATIENCE_S)
    assert container.returncode == 0 and "queries" in said, (container.returncode, said)
    print("container host: good")


if __name__ == "__main__":
    main(*sys.argv[1:])

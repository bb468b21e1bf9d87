"""Test double of lk-emu: has its command line, ready line and control interface, but no drives.

Faults of kind "silent" never take effect, all others at once. Marks: "die" ends the process with status 3, "hang" never
answers the request, "hangup" closes the connection without an answer.
"""

import base64
import hashlib
import json
import os
import signal
import socketserver
import struct
import sys
import threading
from http.server import BaseHTTPRequestHandler
from urllib.parse import parse_qs, unquote, urlsplit

KINDS = [
    {"kind": "jam", "about": "the output is clamped", "parameters": [{"name": "percent"}]},
    {"kind": "current_offset", "about": "a sensor is off", "parameters": [{"name": "offset_A"}, {"name": "channel"}]},
    {"kind": "silent", "about": "nothing is sent", "parameters": []},
]
GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


class World:
    def __init__(self, buses, mode):
        self.buses, self.mode, self.time_s = buses, mode, 0.0
        self.faults, self.directives = [], []
        self.advice = [{"kind": "wrong-length", "bus": "vcan0", "drive": 1, "count": 2}]

    def status(self):
        buses = [{"bus": bus, "ids": ids, "counters": {"queries": 7, "replies": 0, "dropped": {"wrong_length": 2}}}
                 for bus, ids in self.buses.items()]
        clock = {"mode": self.mode, "time_s": self.time_s, "slipped_s": 0}
        return {"version": "0.0.0", "pid": os.getpid(), "clock": clock, "buses": buses, "recording": None}

    def drive(self, bus, id):
        signals = {"angle_deg": 12.5, "speed_dps": 0.0}
        return {"bus": bus, "id": id, "state": "running", "alive": True, "errors": [], "signals": signals,
                "registers": {"ram": {}, "rom": {}}, "counters": {"replies": 7}}

    def direct(self, words):
        self.directives.append(words)
        if words.get("mark") == "die":
            print("lk-emu: failed: the fake was told so", file=sys.stderr, flush=True)
            os._exit(3)
        if words.get("supply_V", 0) > 100:
            return 400, {"error": {"where": "supply_V", "reason": "must be 0 to 100"}}
        names = []
        if "fault" in words:
            names = [self.set_fault(words)]
        for fault in self.faults:
            if words.get("clear") in (fault["name"], fault["kind"], "all"):
                fault["state"] = "cleared"
        return 200, {"time_s": self.time_s, "faults": names}

    def set_fault(self, words):
        kind = words["fault"]["kind"]
        takes_effect = kind != "silent"
        name = words["fault"].get("name", kind)
        begun = self.time_s if "when" not in words else None
        self.faults.append({
            "bus": words["bus"], "name": name, "kind": kind, "ids": ids_of(words["ids"]) if "ids" in words else [], "state": "active",
            "armed_at_s": self.time_s, "began_at_s": begun, "effects": 4 if takes_effect else 0,
            "first_effect_at_s": self.time_s if takes_effect else None,
            "first_on": "drive 2" if takes_effect else "", "parameters": {},
        })  # fmt: skip
        return name


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def address_string(self):
        return "unix"

    def log_message(self, *_):
        pass

    def answer(self, status, body):
        data = json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def body(self):
        return json.loads(self.rfile.read(int(self.headers.get("Content-Length", 0))) or b"null")

    def do_GET(self):
        world = self.server.world
        url = urlsplit(self.path)
        path = url.path[len("/api/v1"):]
        if path == "/telemetry":
            return self.stream(parse_qs(url.query))
        if path.startswith("/drives/"):
            _, _, bus, id = path.split("/")
            return self.answer(200, world.drive(unquote(bus), int(id)))
        answers = {"/status": world.status(), "/clock": world.status()["clock"], "/faults": world.faults,
                   "/faults/kinds": KINDS, "/directives": world.directives, "/advice": world.advice,
                   "/body": {"signals": {"body.fallen": 0, "body.trunk.z_m": 0.37}}}
        if path in answers:
            return self.answer(200, answers[path])
        return self.answer(404, {"error": {"where": path, "reason": "not found"}})

    def do_PUT(self):
        self.server.world.mode = self.body()["mode"]
        self.answer(200, self.server.world.status()["clock"])

    def do_POST(self):
        world, body = self.server.world, self.body()
        if self.path.endswith("/clock/advance"):
            if world.mode != "stepped":
                return self.answer(409, {"error": {"where": "clock", "reason": "runs by itself"}})
            world.time_s = body.get("to_s", world.time_s + body.get("by_s", 0))
            return self.answer(200, {"time_s": world.time_s})
        if body.get("mark") == "hang":
            threading.Event().wait()
        if body.get("mark") == "hangup":
            self.close_connection = True
            return None
        return self.answer(*world.direct(body))

    # Streams three samples: plain, after a ping, in two frames.
    def stream(self, query):
        if query["signals"] == ["nonsense"]:
            return self.answer(400, {"error": {"where": "signals", "reason": "no signal \"nonsense\""}})
        key = self.headers["Sec-WebSocket-Key"] + GUID
        self.send_response(101)
        self.send_header("Upgrade", "websocket")
        self.send_header("Connection", "Upgrade")
        self.send_header("Sec-WebSocket-Accept", base64.b64encode(hashlib.sha1(key.encode()).digest()).decode())
        self.end_headers()
        signals = [name for name in query["signals"][0].split(",") if not name.startswith("body.")]
        body = [name for name in query["signals"][0].split(",") if name.startswith("body.")]
        about = {"bus": query["bus"][0], "ids": [1, 2], "signals": signals, "rate_Hz": float(query["rate_Hz"][0])}
        if body:
            about["body"] = body
        self.frame(0x81, json.dumps(about).encode())
        for n in range(3):
            rows = [[1, n, 10.0], [2, -n, 20.0]]
            sample = {"time_s": n * 0.01, "rows": rows, "pad": "x" * (10, 200, 70000)[n]}
            if body:
                sample["body"] = [0.25 * n for _ in body]
            text = json.dumps(sample).encode()
            if n == 1:
                self.frame(0x89, b"there?")
                pong = self.rfile.read(2 + 4 + 6)
                assert pong[0] == 0x8A and bytes(b ^ pong[2 + i % 4] for i, b in enumerate(pong[6:])) == b"there?"
            if n == 2:
                self.frame(0x01, text[:5])
                self.frame(0x80, text[5:])
            else:
                self.frame(0x81, text)
        if query["rate_Hz"] != ["1"]:
            self.frame(0x88, struct.pack("!H", 1000))
        else:
            self.rfile.read(1)  # keeps the stream open without further samples
        self.close_connection = True

    def frame(self, first, payload):
        length = len(payload)
        if length < 126:
            head = bytes([first, length])
        elif length < 65536:
            head = bytes([first, 126]) + struct.pack("!H", length)
        else:
            head = bytes([first, 127]) + struct.pack("!Q", length)
        self.wfile.write(head + payload)
        self.wfile.flush()


class Server(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    daemon_threads = True


def option(name, default=None):
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


def ids_of(text):
    ids = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        ids += range(int(first), int(last or first) + 1)
    return ids


def main():
    if "--refuse" in sys.argv:
        print("lk-emu: --refuse: there is no such option", file=sys.stderr)
        sys.exit(2)
    # Blocked before any thread starts, and taken by sigwait(): a handler can run too late, after wait() has begun to wait.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    pairs = {sys.argv[n + 1]: ids_of(sys.argv[n + 3]) for n, word in enumerate(sys.argv) if word == "--bus"}
    server = Server(option("--control"), Handler)
    server.world = World(pairs, option("--clock", "realtime"))
    if option("--record"):
        os.makedirs(option("--record"))
    print("one line of its log", file=sys.stderr, flush=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    if "--never-ready" not in sys.argv:
        print("lk-emu ready " + " ".join(pairs), flush=True)
    if "--stubborn" in sys.argv:
        threading.Event().wait()
    signal.sigwait({signal.SIGTERM})
    print("lk-emu stopped after 0.1 s", flush=True)
    os._exit(0)


main()

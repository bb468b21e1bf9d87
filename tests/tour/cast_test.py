#!/usr/bin/python3
"""Is docs/tour.cast a recording of docs/tour.md as it is now?

Made anew by: scripts/with-vcan tests/tour/replay.py build/release/emulator --cast docs/tour.cast
"""

import json
import pathlib
import re
import sys

import session

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"

_, *events = [json.loads(line) for line in (DOCS / "tour.cast").read_text(encoding="utf-8").splitlines()]
shown = "".join(text for _, kind, text in events if kind == "o").replace("\r\n", "\n")
tour = session.commands((DOCS / "tour.md").read_text(encoding="utf-8"))
expected = "".join(re.escape(f"$ {command}\n") + session.pattern(lines).pattern for command, lines in tour)
if not re.fullmatch(expected, shown):
    sys.exit("docs/tour.cast is not a recording of docs/tour.md; see " + __file__ + " for how it is made")

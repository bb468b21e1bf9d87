#!/usr/bin/python3
"""The plans of configs/campaigns as people run them: `delivered_test.py LK_EMU CONFIGS`. Each can be read, and a few
cases of each run, to their end: those with a host program too."""

import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile

SHARDS = {"every_fault": 400, "quadruped": 40, "controller": 20}  # so that one has a few cases


def lk_emu(*words):
    # The python3 of the distribution, which has python-can.
    environment = {**os.environ, "PATH": "/usr/bin:/bin"}
    done = subprocess.run([sys.argv[1], "campaign", *words], capture_output=True, text=True, check=False, env=environment)
    if done.returncode != 0:
        sys.exit(f"lk-emu campaign {' '.join(words)}: status {done.returncode}\n{done.stdout}{done.stderr}")


def main():
    plans = sorted((pathlib.Path(sys.argv[2]) / "campaigns").glob("*.toml"))
    if sorted(SHARDS) != [plan.stem for plan in plans]:
        sys.exit(f"the plans are {[plan.stem for plan in plans]}")
    with tempfile.TemporaryDirectory() as directory:
        for plan in plans:
            store = f"{directory}/{plan.stem}.db"
            lk_emu(str(plan), "-o", store, "--shard", f"0/{SHARDS[plan.stem]}")
            rows = sqlite3.connect(store).execute("SELECT number, outcome, note FROM cases").fetchall()
            if len(rows) < 2 or any(outcome in ("crash", "hang") for _, outcome, _ in rows):
                sys.exit(f"{plan.stem}: {rows}")


main()

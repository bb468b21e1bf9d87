#!/usr/bin/python3
"""Merge and report of a campaign of a million synthetic rows: `campaign_rows.py [ROWS]`.

Writes four shards with the store of lkemu.campaign, merges them, and reports. Prints processor seconds and peak memory of
both commands; exit status 1 if one takes more than 60 s or 500 MB.
"""

import os
import pathlib
import random
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))

from lkemu.campaign.judge import Result  # noqa: E402
from lkemu.campaign.outcomes import NOT_FIRED, OUTCOMES  # noqa: E402
from lkemu.campaign.store import Head, Store  # noqa: E402

SHARDS = 4
MAX_S, MAX_MB = 60.0, 500.0
KINDS = [f"kind_{n}" for n in range(40)]
PLAN = 'scenario = "joint_moves"\n[hazard]\nexpectations = ["it never leaves its space"]\n'


def head_of(rows):
    dimensions = [{"name": "fault.kind", "words": KINDS, "harmless_is_most": False}]
    names = ["fault.id", "fault.at_s", "fault.for_s", "fault.probability", "supply_V", *(f"fault.{kind}.percent" for kind in KINDS[:6])]
    dimensions += [{"name": name, "from": 0.0, "to": 100.0, "harmless_is_most": False} for name in names]
    return Head("0.2.0", "synthetic", "", PLAN, "0" * 16, "random", 1, rows, rows, "synthetic.toml", 200_000_000, tuple(dimensions))


def result(number, draw):
    kind = draw.randrange(len(KINDS))
    values = [KINDS[kind], 1.0, *(float(f"{draw.uniform(0, 100):.4g}") for _ in range(4)), *[None] * 6]
    if kind < 6:
        values[6 + kind] = float(f"{draw.uniform(0, 100):.4g}")
    outcome = draw.choice(list(OUTCOMES))
    effect = None if outcome == NOT_FIRED else draw.randrange(10**9)
    late = None if effect is None else effect + draw.randrange(10**9)
    return Result(number, tuple(values), outcome, effect, effect, late if kind % 2 else None, late if kind % 3 else None, late if kind % 5 else None,
                  "it never leaves its space" if kind % 5 else "", draw.uniform(-1, 1), "running", f"command_{kind % 8}")  # fmt: skip


def write_shard(path, head, shard):
    draw = random.Random(shard)
    store = Store.create(path, head)
    store.note_shard(shard, SHARDS)
    numbers = range(shard, head.numbers, SHARDS)
    for first in range(0, len(numbers), 10_000):
        store.put([result(number, draw) for number in numbers[first : first + 10_000]])
    store.close()


def measure(*words):
    """Returns whether a command of lk-emu campaign stays within the limits."""
    began = time.monotonic()
    child = os.posix_spawn(sys.executable, [sys.executable, "-m", "lkemu.campaign", *words], {**os.environ, "PYTHONPATH": str(ROOT / "python")},
                           file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])  # fmt: skip
    _, status, usage = os.wait4(child, 0)
    wall_s, cpu_s, peak_MB = time.monotonic() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
    print(f"{words[0]}: {cpu_s:.1f} s of a processor, {wall_s:.1f} s, {peak_MB:.0f} MB, status {os.waitstatus_to_exitcode(status)}", flush=True)
    return status == 0 and cpu_s <= MAX_S and peak_MB <= MAX_MB


def main():
    head = head_of(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        parts = [f"part{shard}.db" for shard in range(SHARDS)]
        for shard, part in enumerate(parts):
            write_shard(pathlib.Path(part), head, shard)
        size = sum(os.path.getsize(part) for part in parts)
        print(f"{head.numbers} rows, {size / head.numbers:.0f} bytes each", flush=True)
        fits = [measure("merge", "-o", "all.db", *parts), measure("report", "all.db", "--html", "all.html", "--json", "all.json")]
        print(f"page: {os.path.getsize('all.html') / 1e6:.1f} MB, JSON: {os.path.getsize('all.json') / 1e6:.1f} MB")
    return 0 if all(fits) else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Checks that each vendor directory has exactly the files of its SOURCES, bit for bit."""

import hashlib
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
VENDORS = (ROOT / "web" / "vendor", ROOT / "tests" / "web" / "vendor")


def check(vendor):
    """Returns the number of files, and what is wrong with them."""
    rows = [line.split() for line in (vendor / "SOURCES").read_text().splitlines() if line and not line.startswith("#")]
    named = {row[0]: row[-1] for row in rows}
    there = {path.name for path in vendor.iterdir()} - {"SOURCES"}
    wrong = [f"{name}: in SOURCES, not there" for name in named.keys() - there]
    wrong += [f"{name}: not in SOURCES" for name in there - named.keys()]
    for name in named.keys() & there:
        found = hashlib.sha256((vendor / name).read_bytes()).hexdigest()
        if found != named[name]:
            wrong.append(f"{name}: its SHA-256 is {found}, SOURCES says {named[name]}")
    wrong += [f"{name}: without its licence" for name in there if name.split(".")[0] + ".LICENSE" not in there]
    return len(there), wrong


def main():
    counts, wrong = zip(*map(check, VENDORS))
    wrong = sum(wrong, [])
    print("\n".join(sorted(wrong)) or f"{sum(counts)} files as they were published")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

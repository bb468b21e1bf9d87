#!/usr/bin/env python3
"""Checks that web/vendor has exactly the files of its SOURCES, bit for bit."""

import hashlib
import pathlib
import sys

VENDOR = pathlib.Path(__file__).resolve().parents[1] / "web" / "vendor"


def main():
    rows = [line.split() for line in (VENDOR / "SOURCES").read_text().splitlines() if line and not line.startswith("#")]
    named = {row[0]: row[-1] for row in rows}
    there = {path.name for path in VENDOR.iterdir()} - {"SOURCES"}
    wrong = [f"{name}: in SOURCES, not there" for name in named.keys() - there]
    wrong += [f"{name}: not in SOURCES" for name in there - named.keys()]
    for name in named.keys() & there:
        found = hashlib.sha256((VENDOR / name).read_bytes()).hexdigest()
        if found != named[name]:
            wrong.append(f"{name}: its SHA-256 is {found}, SOURCES says {named[name]}")
    wrong += [f"{name}: without its licence" for name in there if name.split(".")[0] + ".LICENSE" not in there]
    print("\n".join(sorted(wrong)) or f"{len(there)} files as they were published")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/python3
"""Checks that every test named in docs/internals/testing.md exists.

usage: reliability_test.py SOURCES
"""

import pathlib
import re
import sys

SOURCES = pathlib.Path(sys.argv[1])


def text_of(pattern):
    return "\n".join(file.read_text(encoding="utf-8") for file in sorted((SOURCES / "tests").rglob(pattern)))


def main():
    page = (SOURCES / "docs/internals/testing.md").read_text(encoding="utf-8").partition("\n## Guarantees\n")[2]
    code, lists = text_of("*.cpp"), text_of("CMakeLists.txt")
    # GoogleTest cases, and tests of CTest.
    there = {f"{suite}.{case}" for suite, case in re.findall(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", code, re.MULTILINE)}
    there |= set(re.findall(r"add_test\(NAME ([\w.]+)", lists))
    there |= {f"fuzz_corpus_{name}" for name in re.findall(r"lk_fuzz_harness\((\w+)", lists)}
    named = set()
    for row in re.findall(r"^\| (?!promise|what|-).*\|$", page, re.MULTILINE):
        column = row.rstrip("|").split(" | ")[-1]
        tests = set(re.findall(r"`([^`]+)`", column)) | set(re.findall(r"\((vcan\.\w+)\)", column))
        assert tests, f"no test in: {row}"
        named |= tests
    missing = sorted(named - there - {"same_bits."})
    assert not missing, f"docs/internals/testing.md names tests that there are not: {missing}"
    assert len(named) > 60, named


if __name__ == "__main__":
    main()

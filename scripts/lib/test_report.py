"""Reads the JUnit file of a CTest run and prints failures, with the command that repeats each, and skipped tests."""

import collections
import dataclasses
import re
import xml.etree.ElementTree

LONGEST_OUTPUT = 8000  # characters of one failed test
SLOWEST = 5


@dataclasses.dataclass
class Result:
    name: str
    status: str  # passed, failed or skipped
    seconds: float
    output: str


@dataclasses.dataclass
class Counts:
    passed: int
    failed: int
    skipped: int

    def __str__(self):
        return f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped"


def read(path):
    """Returns [Result] of a file written by ctest --output-junit."""
    statuses = {"run": "passed", "notrun": "skipped", "disabled": "skipped"}
    results = []
    for case in xml.etree.ElementTree.parse(path).getroot().iter("testcase"):
        status = statuses.get(case.get("status"), "failed")
        output = case.findtext("system-out") or ""
        if status == "skipped" and not output:
            status = "failed"  # the program is missing
        results.append(Result(case.get("name"), status, float(case.get("time")), output))
    return results


def reason_of(result):
    """Returns why a test was skipped, in one line."""
    lines = [line.strip() for line in result.output.splitlines() if line.strip()]
    for index, line in enumerate(lines):
        if line.endswith("Skipped") and index + 1 < len(lines):  # GoogleTest: FILE:LINE: Skipped, then the reason
            return lines[index + 1]
    said = [line for line in lines if line.lower().startswith("skipped")]
    return (said or lines or ["no reason given"])[-1]


def show(results, command):
    """Prints failures, reasons of skipped tests and the slowest tests; returns the Counts.

    `command` and -R with its name repeat a test.
    """
    for result in results:
        if result.status == "failed":
            print(f"\nFAILED {result.name} ({result.seconds:.1f} s)\n{result.output[-LONGEST_OUTPUT:].rstrip()}")
            print(f"to repeat it: {command}-R '^{re.escape(result.name)}$'")
    reasons = collections.Counter(reason_of(result) for result in results if result.status == "skipped")
    for reason, count in reasons.items():
        print(f"skipped {count}: {reason}")
    slowest = sorted(results, key=lambda result: -result.seconds)[:SLOWEST]
    print("slowest: " + ", ".join(f"{result.name} {result.seconds:.0f} s" for result in slowest))
    return counts_of(results)


def counts_of(results):
    return Counts(*(sum(result.status == status for result in results) for status in ("passed", "failed", "skipped")))

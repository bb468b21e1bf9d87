"""scripts/test --all: every test before a release, in two lanes, with a table for the release record."""

import json
import os
import pathlib
import subprocess
import threading
import time

import test_report
from test_steps import Failed

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "all"
FULL = ROOT / "build" / "full"


def ctest(report, label, *more):
    return ["ctest", "--test-dir", FULL, "-L", f"^{label}$", "--no-tests=error", "--output-junit", report, *more]


def bare_tests():
    listed = subprocess.run(["ctest", "--test-dir", FULL, "-L", "^bare$", "--show-only=json-v1"], check=True,
                            stdout=subprocess.PIPE)
    return [test["name"] for test in json.loads(listed.stdout)["tests"]]


class Step:
    """A command with its log, and its JUnit file if it is a CTest run."""

    def __init__(self, name, command, report=None):
        self.name, self.command, self.report = name, [str(part) for part in command], report
        self.result, self.tests, self.seconds = "not run", "", 0.0

    def run(self):
        start = time.monotonic()
        log = FOLDER / f"{self.name}.log"
        with log.open("w") as output:
            status = subprocess.run(self.command, stdin=subprocess.DEVNULL, stdout=output, stderr=output).returncode
        self.seconds = time.monotonic() - start
        self.result = "failed" if status else "passed"
        if self.report and self.report.exists():
            results = test_report.read(self.report)
            self.tests = str(test_report.counts_of(results))
            if all(result.status == "skipped" for result in results):
                self.result = "skipped"
        print(f"{self.name:20} {self.seconds:6.0f} s   {self.result} {self.tests}"
              + (f"   {log.relative_to(ROOT)}" if status else ""), flush=True)


def ctest_step(name, label, *more):
    report = FOLDER / f"{name}.xml"
    return Step(name, ctest(report, label, *more), report)


def lanes():
    """The steps of each lane. The second needs what the step `full` has built."""
    tests = [Step("test", ["scripts/test"]), Step("sanitized", ["scripts/test", "--sanitized"]),
             Step("golden", ["tests/golden/freeze", FULL / "emulator" / "lk-emu-body"]),
             *(ctest_step(kind, kind) for kind in "unit host vcan docs fidelity campaign fuzz body web slow".split())]
    machines = [ctest_step("package", "package"), ctest_step("elsewhere", "elsewhere"),
                *(ctest_step(name, "bare", "-R", f"^{name}$") for name in bare_tests())]
    return tests, machines


class Record:
    """The steps that have passed for this commit, in a file that --resume reads."""

    def __init__(self, resume):
        self.path = FOLDER / "passed.json"
        self.commit = subprocess.run(["git", "rev-parse", "HEAD"], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
        self.lock = threading.Lock()
        self.passed = {}
        if resume and self.path.exists():
            known = json.loads(self.path.read_text())
            self.passed = known["passed"] if known["commit"] == self.commit else {}

    def recall(self, step):
        """Whether the step has passed already; fills in its figures then."""
        if step.name in self.passed:
            step.result, step.tests, step.seconds = self.passed[step.name]
            return True
        return False

    def keep(self, step):
        if step.result == "failed":
            return
        with self.lock:
            self.passed[step.name] = step.result, step.tests, step.seconds
            text = json.dumps({"commit": self.commit, "passed": self.passed}, indent=1)
            part = self.path.with_suffix(".part")
            part.write_text(text)
            os.replace(part, self.path)


def table(steps, commit):
    rows = [f"| {step.name} | {step.result} | {step.tests} | {step.seconds:.0f} |" for step in steps]
    return "\n".join([f"Commit {commit}", "", "| step | result | tests | seconds |", "|---|---|---|---|", *rows])


def run(resume, configure):
    """`configure` installs the packages of the preset full and configures it. Returns the exit status."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    record = Record(resume)
    os.environ.update(LKEMU_ALL_VALUES="1", BARE_BUILDS=str(FOLDER / "bare"))
    configure()
    full = Step("full", ["cmake", "--build", "--preset", "full"])
    full.run()  # up to date in a moment if it was built before
    if full.result == "failed":
        raise Failed("the build of the preset full failed: build/all/full.log")

    def walk(steps):
        for step in steps:
            if not record.recall(step):
                step.run()
                record.keep(step)

    both = lanes()
    threads = [threading.Thread(target=walk, args=(steps,)) for steps in both]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    steps = [full, *both[0], *both[1]]
    text = table(steps, record.commit)
    (FOLDER / "table.md").write_text(text + "\n")
    failed = [step.name for step in steps if step.result == "failed"]
    print(f"\n{text}\n\nThis table: build/all/table.md")
    print(f"test: failed: {' '.join(failed)}" if failed else "test: every step passed")
    return 1 if failed else 0

"""scripts/test --all: every test before a release, in two lanes, with a table for the release record."""

import json
import os
import pathlib
import subprocess
import sys
import threading
import time

import test_report

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "all"
FULL = ROOT / "build" / "full"
# Makes the optimised tests run whole sweeps and full durations.
ALL_VALUES = {"LKEMU_ALL_VALUES": "1"}


class Step:
    """A command with its log and, if it is a CTest run, its JUnit file."""

    def __init__(self, name, command, report=None, environment=None):
        self.name, self.command, self.report = name, [str(part) for part in command], report
        self.environment = {**os.environ, **(environment or {})}
        self.result, self.tests, self.seconds = "not run", "", 0.0

    def run(self):
        start = time.monotonic()
        try:
            self.result = self.outcome()
        except Exception as error:
            self.result, self.tests = "failed", str(error)
        self.seconds = time.monotonic() - start
        print(f"{self.name:20} {self.seconds:6.0f} s   {self.result} {self.tests}", flush=True)

    def outcome(self):
        if self.report:
            self.report.unlink(missing_ok=True)
        log = FOLDER / f"{self.name}.log"
        with log.open("w") as output:
            status = subprocess.run(self.command, stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                                    env=self.environment).returncode
        results = test_report.read(self.report) if self.report and self.report.exists() else []
        self.tests = str(test_report.counts_of(results)) if results else ""
        if status or (self.report and not results):
            print(f"{self.name} failed: {log.relative_to(ROOT)}", flush=True)
            return "failed"
        return "skipped" if results and all(result.status == "skipped" for result in results) else "passed"


def ctest_step(name, label, *more):
    report = FOLDER / f"{name}.xml"
    command = ["ctest", "--test-dir", FULL, "-L", f"^{label}$", "--no-tests=error", "--output-on-failure", "--output-junit", report]
    return Step(name, [*command, *more], report, ALL_VALUES)


def labels_of_full():
    path = FULL / "labels.txt"
    return path.read_text().split() if path.exists() else []


def bare_tests():
    listed = subprocess.run(["ctest", "--test-dir", FULL, "-L", "^bare$", "--show-only=json-v1"], check=True,
                            stdout=subprocess.PIPE)
    return [test["name"] for test in json.loads(listed.stdout)["tests"]]


def lanes(full_is_built):
    """Returns the steps of each lane; without the preset `full` only those that do not need it."""
    everyday = [Step("test", ["scripts/test"]), Step("sanitized", ["scripts/test", "--sanitized"])]
    if not full_is_built:
        return everyday, []
    program = next(FULL / "emulator" / name for name in ("lk-emu-body", "lk-emu") if (FULL / "emulator" / name).exists())
    kinds = [kind for kind in "unit host vcan docs fidelity campaign fuzz body web slow".split() if kind in labels_of_full()]
    return ([*everyday, Step("golden", ["tests/golden/freeze", program]), *(ctest_step(kind, kind) for kind in kinds)],
            [ctest_step("package", "package"), ctest_step("elsewhere", "elsewhere"),
             *(ctest_step(name, "bare", "-R", f"^{name}$") for name in bare_tests())])


class Record:
    """Steps that have passed for this commit, in a file that --resume reads."""

    def __init__(self, resume):
        self.path = FOLDER / "passed.json"
        self.commit = git("rev-parse", "HEAD")
        self.lock = threading.Lock()
        self.passed = {}
        if resume and git("status", "--porcelain"):
            print("uncommitted changes: every step runs")
        elif resume and self.path.exists():
            known = json.loads(self.path.read_text())
            self.passed = known["passed"] if known["commit"] == self.commit else {}

    def recall(self, step):
        """Returns whether the step has passed already; if so, restores its results."""
        if step.name in self.passed:
            step.result, step.tests, step.seconds = self.passed[step.name]
            return True
        return False

    def keep(self, step):
        if step.result != "passed":
            return
        with self.lock:
            self.passed[step.name] = step.result, step.tests, step.seconds
            part = self.path.with_suffix(".part")
            part.write_text(json.dumps({"commit": self.commit, "passed": self.passed}, indent=1))
            os.replace(part, self.path)


def git(*arguments):
    return subprocess.run(["git", *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def table(steps, commit):
    rows = [f"| {step.name} | {step.result} | {step.tests} | {step.seconds:.0f} |" for step in steps]
    return "\n".join([f"Commit {commit}", "", "| step | result | tests | seconds |", "|---|---|---|---|", *rows])


def show_results(steps):
    for step in steps:
        if step.report and step.report.exists():
            print(f"\n{step.name}")
            test_report.show(test_report.read(step.report), f"scripts/test {step.name.partition('.')[0]} ")


def walk(steps, record, stop):
    for step in steps:
        if stop.is_set():
            return
        if not record.recall(step):
            step.run()
            record.keep(step)


def run(resume, configure):
    """Runs all steps. `configure` installs the packages of preset full and configures it. Returns the exit status."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    record = Record(resume)
    os.environ["BARE_BUILDS"] = str(FOLDER / "bare")
    configure()
    full = Step("full", ["cmake", "--build", "--preset", "full"])
    full.run()  # fast if it was built before
    both = lanes(full.result == "passed")
    stop = threading.Event()
    threads = [threading.Thread(target=walk, args=(steps, record, stop)) for steps in both]
    for thread in threads:
        thread.start()
    try:
        for thread in threads:
            thread.join()
    except KeyboardInterrupt:
        stop.set()
        sys.exit("test: interrupted; scripts/test --all --resume skips the steps that passed")
    steps = [full, *both[0], *both[1]]
    show_results(steps)
    text = table(steps, record.commit)
    (FOLDER / "table.md").write_text(text + "\n")
    failed = [step.name for step in steps if step.result not in ("passed", "skipped")]
    print(f"\n{text}\n\nThis table: build/all/table.md")
    print(f"test: failed: {' '.join(failed)}" if failed else "test: every step passed")
    return 1 if failed else 0

"""scripts/test: installs packages, builds a preset and runs the tests with the chosen CTest labels."""

import argparse
import os
import pathlib
import re
import sys

import release_run
import test_report
from test_steps import Failed, Steps

ROOT = pathlib.Path(__file__).resolve().parents[2]
KINDS = re.search(r"LK_TEST_KINDS ([^)]*)", (ROOT / "cmake/Tests.cmake").read_text())[1].split()
DEFAULT_KINDS = ["unit", "host", "vcan", "docs"]
# Groups of packages.txt that each preset needs.
PACKAGES = {
    "test": ["build", "run", "test"],
    "full": ["build", "run", "test", "body", "package", "release"],
    "dev": ["build", "run", "test", "sanitized"],
}
USAGE = """scripts/test [NAME...] [-R PATTERN]
       scripts/test --sanitized [-R PATTERN]
       scripts/test --all [--resume]"""


def parse(arguments):
    parser = argparse.ArgumentParser(
        prog="scripts/test", usage=USAGE, allow_abbrev=False,
        description=f"Install what is missing, build, and run tests. Without NAME: the kinds {', '.join(DEFAULT_KINDS)}.")
    parser.error = lambda message: sys.exit(refuse(f"{message}; scripts/test --help lists the options"))
    parser.add_argument("names", metavar="NAME", nargs="*",
                        help=f"a kind of test ({' '.join(KINDS)}) or a room, the folder whose behaviour is tested, e.g. core")
    parser.add_argument("-R", metavar="PATTERN", dest="pattern", help="only tests whose names match this regular expression")
    parser.add_argument("--sanitized", action="store_true",
                        help="check the format; run the core and all parsers under AddressSanitizer and UBSan")
    parser.add_argument("--all", action="store_true", help="everything, before a release: hours")
    parser.add_argument("--resume", action="store_true", help="with --all: skip the steps that passed for this commit")
    options = parser.parse_args(arguments)
    if options.sanitized + options.all + bool(options.names) > 1 or options.all and options.pattern:
        parser.error("--sanitized and --all run tests of their own: without NAME, and --all without -R")
    if options.resume and not options.all:
        parser.error("--resume needs --all")
    rooms = rooms_in_cmake()
    for name in options.names:
        if name not in KINDS and name not in rooms:
            parser.error(f"{name}: neither a kind of test nor a room; rooms: {' '.join(sorted(rooms))}")
    return options


def rooms_in_cmake():
    """Returns the second labels of the tests, and the folders of lk_room_test."""
    text = "".join(path.read_text() for path in (ROOT / "tests").rglob("CMakeLists.txt"))
    return {*re.findall(r"LABELS \w+ (\w+)", text), *re.findall(r"^ *lk_room_test\((\w+)", text, re.MULTILINE)}


def refuse(message):
    print(f"test: {message}", file=sys.stderr)
    return 2


def configure(steps, preset, *more):
    """Installs packages (with `more` groups) and configures; returns the labels of the preset's tests."""
    steps.run(f"packages {preset}", ["scripts/packages", *PACKAGES[preset], *more])
    launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if os.path.exists("/usr/bin/ccache") else []
    steps.run(f"configure {preset}", ["cmake", "--preset", preset, *launcher])
    return (ROOT / "build" / preset / "labels.txt").read_text().split()


def run_labels(steps, preset, labels, pattern, command):
    """Builds and runs the tests that have one of the labels; `command` repeats them."""
    targets = [f"test_{label}" for label in labels]
    steps.run(f"build {preset}", ["cmake", "--build", "--preset", preset, "--target", *targets])
    folder = ROOT / "build" / preset
    report = folder / f"report-{'-'.join(labels)}.xml"
    report.unlink(missing_ok=True)
    ctest = ["ctest", "--test-dir", folder, "-L", f"^({'|'.join(labels)})$", "--output-junit", report,
             "-j", str(len(os.sched_getaffinity(0))), "--no-tests=ignore"]
    if preset == "test":
        ctest += ["-L", f"^({'|'.join(DEFAULT_KINDS)})$"]  # others need more packages
    steps.run(f"tests {preset}", ctest + (["-R", pattern] if pattern else []), may_fail=True)
    results = test_report.read(report) if report.exists() else []
    if not results:
        raise Failed(f"no test of {' '.join(labels)} matches {pattern}" if pattern else f"{' '.join(labels)}: no test ran")
    return test_report.show(results, command)


def run_some(steps, names, pattern):
    """Runs the selected tests: the default kinds with preset `test`, others, which need more packages, with `full`."""
    labels = names or DEFAULT_KINDS
    preset = "full" if set(labels) & set(KINDS) - set(DEFAULT_KINDS) else "test"
    known = configure(steps, preset, *(["bare"] if "bare" in labels else []))
    if preset == "test" and not set(labels) <= set(known):
        preset = "full"
        known = configure(steps, preset)
    for label in labels:
        if label not in known:
            raise Failed(f"{label}: no test has this label; labels: {' '.join(known)}")
    return run_labels(steps, preset, labels, pattern, " ".join(["scripts/test", *names, ""]))


def run_sanitized(steps, pattern):
    configure(steps, "dev")
    for line in steps.run("format", ["scripts/lib/check_format"]):
        print(line, end="")  # reason why the format could not be checked
    return run_labels(steps, "dev", ["sanitized"], pattern, "scripts/test --sanitized ")


def main():
    options = parse(sys.argv[1:])
    os.chdir(ROOT)
    # Lets clones in different folders share ccache objects.
    os.environ.update(CCACHE_BASEDIR=str(ROOT), CCACHE_NOHASHDIR="1")
    steps = Steps()
    try:
        if options.all:
            return release_run.run(options.resume, lambda: configure(steps, "full", "bare"))
        counts = run_sanitized(steps, options.pattern) if options.sanitized else run_some(steps, options.names, options.pattern)
    except Failed as failure:
        print(f"test: {failure}")
        return 1
    print(counts)
    print(f"test: {counts} in {steps.seconds():.0f} s")
    return 1 if counts.failed else 0


if __name__ == "__main__":
    sys.exit(main())

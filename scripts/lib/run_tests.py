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
KINDS = "unit host vcan web body campaign docs fidelity package bare elsewhere fuzz slow".split()
DEFAULT_KINDS = ["unit", "host", "vcan", "docs"]
# Each preset with the groups of packages.txt that it needs.
PACKAGES = {
    "test": ["build", "run", "test"],
    "full": ["build", "run", "test", "body", "package", "bare", "release"],
    "dev": ["build", "run", "test", "sanitized"],
}
USAGE = """scripts/test [NAME...] [-R PATTERN]
       scripts/test --sanitized
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
    if options.sanitized + options.all + bool(options.names or options.pattern) > 1:
        parser.error("--sanitized and --all take no other tests")
    if options.resume and not options.all:
        parser.error("--resume needs --all")
    rooms = {"python", *(path.name for path in (ROOT / "tests").rglob("*") if path.is_dir())}
    for name in options.names:
        if name not in KINDS and name not in rooms:
            parser.error(f"{name}: neither a kind of test nor a folder below tests/")
    return options


def refuse(message):
    print(f"test: {message}", file=sys.stderr)
    return 2


def configure(steps, preset):
    """Installs and configures; returns the labels that the tests of the preset have."""
    steps.run(f"packages {preset}", ["scripts/packages", *PACKAGES[preset]])
    launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if os.path.exists("/usr/bin/ccache") else []
    steps.run(f"configure {preset}", ["cmake", "--preset", preset, *launcher])
    return (ROOT / "build" / preset / "labels.txt").read_text().split()


def run_labels(steps, preset, labels, pattern=None, jobs=None):
    """Builds and runs the tests that have one of the labels."""
    targets = [f"test_{label}" for label in labels]
    steps.run(f"build {preset}", ["cmake", "--build", "--preset", preset, "--target", *targets])
    folder = ROOT / "build" / preset
    report = folder / f"report-{'-'.join(labels)}.xml"
    report.unlink(missing_ok=True)
    command = ["ctest", "--test-dir", folder, "-L", f"^({'|'.join(labels)})$", "--output-junit", report,
               "-j", str(jobs or len(os.sched_getaffinity(0))), "--no-tests=ignore"]
    steps.run(f"tests {preset}", command + (["-R", pattern] if pattern else []), may_fail=True)
    results = test_report.read(report) if report.exists() else []
    if not results:
        raise Failed(f"no test of {' '.join(labels)} matches {pattern}" if pattern else f"{' '.join(labels)}: no test ran")
    return test_report.show(results)


def run_some(steps, names, pattern):
    """The preset `test` has the tests of every day. The others need more packages and programs."""
    labels = names or DEFAULT_KINDS
    preset = "full" if set(labels) & set(KINDS) - set(DEFAULT_KINDS) else "test"
    known = configure(steps, preset)
    if preset == "test" and not set(labels) <= set(known):
        preset = "full"
        known = configure(steps, preset)
    for label in labels:
        if label not in known:
            raise Failed(f"{label}: no test has this label; labels: {' '.join(known)}")
    return run_labels(steps, preset, labels, pattern)


def run_sanitized(steps):
    configure(steps, "dev")
    steps.run("format", ["scripts/lib/check_format"])
    return run_labels(steps, "dev", ["sanitized"])


def main():
    options = parse(sys.argv[1:])
    os.chdir(ROOT)
    # Objects of one clone then serve clones in other folders.
    os.environ.update(CCACHE_BASEDIR=str(ROOT), CCACHE_NOHASHDIR="1")
    steps = Steps()
    try:
        if options.all:
            return release_run.run(options.resume, lambda: configure(steps, "full"))
        counts = run_sanitized(steps) if options.sanitized else run_some(steps, options.names, options.pattern)
    except Failed as failure:
        print(f"test: {failure}")
        return 1
    print(f"{counts} in {steps.seconds():.0f} s")
    print(counts)
    return 1 if counts.failed else 0


if __name__ == "__main__":
    sys.exit(main())

"""`python3 -m lkemu.campaign`, the command `lk-emu campaign`."""

from __future__ import annotations

import argparse
import contextlib
import os
import pathlib
import shlex
import sqlite3
import sys
import time
from typing import Callable, Dict, List, Optional

from ..command import Parser, libraries, output_file, printable, run
from ..errors import StartError

with libraries("campaign", __name__):
    from .dask_runs import DaskRuns, check_address
    from .engine import Shard, run_campaign, runs_of
    from .export import export
    from .host_runs import HostRuns
    from .interruption import Interruption
    from .merge import merge
    from .one_case import print_cost, run_one, spread_cases, values_of, write_outputs
    from .plan import Plan, PlanError
    from .plan_file import load_plan
    from .plan_host import plan_hash
    from .program import Program
    from .progress import Progress
    from .store import Store, StoreError, head_of
    from .thresholds import Threshold, check_thresholds, parse_threshold

MAX_UNCONFIRMED = 1_000_000_000  # cases; a larger campaign needs --yes
EPILOG = """
Examples:
  lk-emu campaign every_fault --dry-run                     how many cases, and what they cost
  lk-emu campaign every_fault -o night.db --html night.html
  lk-emu campaign every_fault --case 4711 --csv case.csv    one of them again
  lk-emu campaign every_fault -o part3.db --shard 3/8       and then: lk-emu campaign merge -o night.db part*.db

Exit status: 0 done, 1 a --require does not hold (compare: cases are worse; merge: some are missing), 2 unusable input,
130 interrupted: --resume goes on.
"""


def parse(words: List[str]) -> argparse.Namespace:
    if words and words[0] in OTHER_ACTIONS:
        parse_other, act = OTHER_ACTIONS[words[0]]
        given = parse_other(f"lk-emu campaign {words[0]}", words[1:])
        given.act = act
        return given
    parser = Parser("lk-emu campaign", description="Run many cases of a scenario with faults, and report the results", epilog=EPILOG,
                    formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)  # fmt: skip
    parser.add_argument("plan", metavar="PLAN", help="a plan: a file, or the name of a shipped one")
    parser.add_argument("-o", "--output", metavar="FILE", help="results, an SQLite file (default: the plan's name, .db)")
    parser.add_argument("-j", "--jobs", type=int, metavar="N", help=f"cases at once (default: {os.cpu_count() or 1})")
    parser.add_argument("--dask", metavar="ADDRESS", help="run the cases on the workers of a dask scheduler: 127.0.0.1:PORT or tls://HOST:PORT")
    parser.add_argument("--shard", type=parse_shard, default=Shard(), metavar="I/N", help="only the cases whose number divided by N leaves I")
    parser.add_argument("--resume", action="store_true", help="resume an existing results file")
    parser.add_argument("--quiet", action="store_true", help="print problems only")
    parser.add_argument("--dry-run", action="store_true", help="print the number of cases by dimension and the cost; run nothing")
    parser.add_argument("--yes", action="store_true", help="allow more than 1000 million cases")
    parser.add_argument("--case", type=int, metavar="NUMBER", help="run one case and show it")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="override a value of this case: NAME=VALUE")
    parser.add_argument("--scenario", metavar="FILE", help="write this case as a scenario, for lk-emu run")
    parser.add_argument("--csv", metavar="FILE", help="write signals of this case")
    parser.add_argument("--signals", metavar="SIGNALS", help="signals to write: true_angle_deg,speed_dps,…")
    parser.add_argument("--rate", metavar="HZ", help="rows per simulated second (default 100)")
    parser.add_argument("--candump", metavar="FILE", help="write all frames of this case, as candump -L does")
    add_report_options(parser)
    given = parser.parse_args(words)
    given.act = run_plan
    given.words = words
    check_options(given)
    return given


def check_options(given: argparse.Namespace) -> None:
    """Raises StartError for options that exclude each other, or that need another option."""
    if given.jobs is not None and given.jobs < 1:
        raise StartError("--jobs: must be 1 or more")
    if given.dask is not None and given.jobs is not None:
        raise StartError("--jobs: does not go together with --dask: the threads of its workers are the jobs")
    given.jobs = given.jobs or os.cpu_count() or 1
    for option in ("set", "scenario", "csv", "signals", "rate", "candump"):
        if getattr(given, option) and given.case is None:
            raise StartError(f"--{option}: belongs to --case")
    for option in ("signals", "rate"):
        if getattr(given, option) and given.csv is None:
            raise StartError(f"--{option}: belongs to --csv")
    for first, chosen in (("--case", given.case is not None), ("--dry-run", given.dry_run)):
        for option in ("resume", "html", "json", "junit", "require", "dask"):
            if chosen and getattr(given, option):
                raise StartError(f"--{option}: does not go together with {first}")


def add_report_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--html", metavar="FILE", help="write the report as a page")
    parser.add_argument("--json", metavar="FILE", help="write the report as JSON")
    parser.add_argument("--junit", metavar="FILE", help="write a test for each kind of fault, as JUnit XML")
    parser.add_argument("--require", metavar="TEXT", action="append", default=[],
                        help='requirement: "coverage>=0.99" or "silently_wrong<=0" (repeatable)')  # fmt: skip


def parse_report(name: str, words: List[str]) -> argparse.Namespace:
    parser = Parser(name, description="Report the results of a campaign")
    parser.add_argument("results", metavar="RESULTS", help="results file of a campaign")
    add_report_options(parser)
    return parser.parse_args(words)


def parse_compare(name: str, words: List[str]) -> argparse.Namespace:
    parser = Parser(name, description="Compare two campaigns case by case, and list what got worse")
    parser.add_argument("before", metavar="BEFORE", help="earlier results file of the same plan")
    parser.add_argument("now", metavar="NOW", help="later results file")
    parser.add_argument("--html", metavar="FILE", help="write an HTML page, with the report of NOW")
    parser.add_argument("--json", metavar="FILE", help="write the comparison as JSON")
    return parser.parse_args(words)


def parse_export(name: str, words: List[str]) -> argparse.Namespace:
    parser = Parser(name, description="Print all cases as CSV, byte for byte the same for any --jobs, shards and workers")
    parser.add_argument("results", metavar="RESULTS", help="results file of a campaign")
    return parser.parse_args(words)


def parse_merge(name: str, words: List[str]) -> argparse.Namespace:
    parser = Parser(name, description="Merge the shards of a campaign")
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help="file to write")
    parser.add_argument("parts", metavar="PART", nargs="+", help="results files of shards or merges")
    return parser.parse_args(words)


def parse_shard(text: str) -> Shard:
    index, _, count = text.partition("/")
    if not (index.isdecimal() and count.isdecimal() and int(index) < int(count)):
        raise argparse.ArgumentTypeError(f'"{text}" is not a shard; 8 shards are 0/8 to 7/8')
    return Shard(int(index), int(count))


def run_plan(given: argparse.Namespace) -> int:
    interruption = Interruption()
    thresholds = [parse_threshold(text) for text in given.require]
    if given.dask:
        check_address(given.dask)
    program = Program()
    plan = load_plan(given.plan, program)
    if given.case is not None:
        return show_case(plan, program, given)
    if given.dry_run:
        print_cost(plan, program, given.jobs)
        return 0
    if plan.numbers > MAX_UNCONFIRMED and not given.yes:
        raise StartError(f"{plan.file}: has {plan.numbers} cases, more than 1000 million; confirm with --yes, or see --dry-run")
    path = pathlib.Path(given.output or f"{plan.name}.db")
    check_outputs(given, {"the file of the results": str(path), "the plan": str(plan.file), "the plan's scenario": plan.scenario})
    if plan.host is not None:
        HostRuns(plan, program, 1).check(spread_cases(plan, 1)[0])
    runs = DaskRuns(plan, program, given.dask) if given.dask else runs_of(plan, program, given.jobs)
    store = store_of(path, plan, program, given.resume)
    before, began = store.count(), time.monotonic()
    progress = Progress(given.shard.size(plan.numbers), before, sys.stderr.isatty() and not given.quiet)
    done = 0

    def show(cases: int) -> None:
        nonlocal done
        done = cases
        progress.show(cases)

    try:
        run_campaign(plan, store, given.shard, runs, show, interruption)
    except KeyboardInterrupt:
        progress.end()
        command = shlex.join(["lk-emu", "campaign", *given.words, *([] if given.resume else ["--resume"])])
        print(f"lk-emu: stopped after {before + done} cases, all kept in {printable(str(path))}; {printable(command)} goes on", file=sys.stderr)
        return 130
    finally:
        progress.end()
        failures = store.failures()
        store.close()
        if isinstance(runs, DaskRuns):
            runs.close()
    if not given.quiet:
        took_s = time.monotonic() - began
        print(f"{plan.name}: {done} cases in {took_s:.3g} s, {done / max(took_s, 1e-9):.3g}/s; {printable(str(path))}")
    status = report(path, given, thresholds)
    if failures:
        failed = sum(failures.values())
        print(f"lk-emu: {failed} case{'' if failed == 1 else 's'} without a result, because the machine failed; --resume runs them again", file=sys.stderr)
    return 1 if failures else status


def show_case(plan: Plan, program: Program, given: argparse.Namespace) -> int:
    from . import report as reports  # pylint: disable=import-outside-toplevel
    from .answer import Answer

    for option in ("csv", "candump"):
        if plan.host is not None and getattr(given, option) is not None:
            raise StartError(f"--{option}: not possible with [host]: the case would run without the host program")
    values = values_of(plan, given.case, given.set)
    result = run_one(plan, program, given.case, values)
    print(reports.sentence(Answer(head_of(plan, program.version(), "")), result))
    write_outputs(plan, program, given.case, values, given)
    return 0


def report(path: pathlib.Path, given: argparse.Namespace, thresholds: List[Threshold]) -> int:
    """Prints and writes the reports. Returns the exit status: 1 if a --require is not met."""
    from . import report as reports  # pylint: disable=import-outside-toplevel  # loading jinja2 and scipy takes 1 s
    from .answer import answer_of

    with contextlib.closing(Store.read(path)) as store:
        answer = answer_of(store.head, store, store.failures())
    required = check_thresholds(answer, thresholds)
    write_text(given.html, "--html", lambda: reports.page(answer, required))
    write_text(given.json, "--json", lambda: reports.json_report(answer, required))
    write_text(given.junit, "--junit", lambda: reports.junit(answer))
    if not getattr(given, "quiet", False):
        print(reports.text_report(answer, required), end="")
    else:
        print("".join(f"{one}\n" for one in required if not one.holds), end="")
    return 0 if all(one.holds for one in required) else 1


def write_text(path: Optional[str], option: str, text: Callable[[], str]) -> None:
    if path is not None:
        with output_file(path, option) as file:
            file.write(text().encode())


def check_outputs(given: argparse.Namespace, others: Dict[str, str]) -> None:
    """Checks before the first case runs that each report can be written, and to a file of its own. Raises StartError.

    `others`: files that no report may overwrite; the keys describe them in messages.
    """
    for option in ("html", "json", "junit"):
        file = getattr(given, option, None)
        if file is None:
            continue
        folder = os.path.dirname(file) or "."
        if not os.path.isdir(folder):
            raise StartError(f"--{option}: no such directory: {folder}")
        if os.path.isdir(file):
            raise StartError(f"--{option}: {file} is a directory")
        if not os.access(folder, os.W_OK):
            raise StartError(f"--{option}: {file} cannot be written: {folder} is read-only")
        for what, other in others.items():
            if os.path.realpath(file) == os.path.realpath(other):
                raise StartError(f"--{option}: {file} is also {what}; choose another name")
        others = {**others, f"for --{option}": file}


def store_of(path: pathlib.Path, plan: Plan, program: Program, resume: bool) -> Store:
    head = head_of(plan, program.version(), plan_hash(plan, program))
    return Store.resume(path, head) if resume and path.exists() else Store.create(path, head)


def export_results(given: argparse.Namespace) -> int:
    store = Store.read(pathlib.Path(given.results))
    names = [one["name"] for one in store.head.dimensions]
    sys.stdout.writelines(export(names, store))
    store.close()
    return 0


def merge_results(given: argparse.Namespace) -> int:
    merged = merge(pathlib.Path(given.output), [pathlib.Path(part) for part in given.parts])
    print(f"{printable(given.output)}: {merged}")
    return 0 if merged.is_whole else 1


def report_results(given: argparse.Namespace) -> int:
    check_outputs(given, {"the file of the results": given.results})
    return report(pathlib.Path(given.results), given, [parse_threshold(text) for text in given.require])


def compare_results(given: argparse.Namespace) -> int:
    from . import report as reports  # pylint: disable=import-outside-toplevel
    from .answer import Answer, answer_of
    from .compare import compare

    check_outputs(given, {"the file of results before": given.before, "the file of results": given.now})
    with contextlib.closing(Store.read(pathlib.Path(given.before))) as before:
        with contextlib.closing(Store.read(pathlib.Path(given.now))) as now:
            comparison = compare(before.head, before, now.head, now)
            answer = answer_of(now.head, now) if given.html else Answer(now.head)
    write_text(given.html, "--html", lambda: reports.page(answer, (), comparison))
    print(reports.comparison_text(answer, comparison), end="")
    write_text(given.json, "--json", lambda: reports.comparison_json(answer, comparison))
    return 1 if comparison.worse else 0


OTHER_ACTIONS = {
    "export": (parse_export, export_results),
    "merge": (parse_merge, merge_results),
    "report": (parse_report, report_results),
    "compare": (parse_compare, compare_results),
}


def main() -> int:
    given = parse(sys.argv[1:])
    try:
        return int(given.act(given))
    except KeyboardInterrupt:
        print("lk-emu: interrupted", file=sys.stderr)
        return 130
    except (PlanError, StoreError) as problem:
        raise StartError(str(problem)) from None
    except sqlite3.Error as problem:
        raise StartError(f"damaged results: {problem}") from None


if __name__ == "__main__":
    run(main)

"""Calls lk-emu to list faults and to check and compute cases (docs/reference/formats.md)."""

from __future__ import annotations

import json
import subprocess
import tempfile
import threading
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence

from ..errors import Error, StartError
from ..program import find_program


class Program:
    def __init__(self, path: Optional[str] = None) -> None:
        self.path = find_program(path)

    def faults(self) -> List[Dict[str, Any]]:
        return list(json.loads(self._output("faults", "--json")))

    def version(self) -> str:
        return self._output("--version").split()[-1]

    def generations(self) -> List[str]:
        return ["legacy", "late-legacy", "v235", "v236", "v236b", "seen"]

    def check(self, requests: Sequence[Mapping[str, Any]]) -> List[Dict[str, Any]]:
        """Checks cases without running them. Returns answers in any order."""
        return list(self.run(requests, jobs=1, check=True))

    def run(self, requests: Iterable[Optional[Mapping[str, Any]]], jobs: int, check: bool = False) -> Iterator[Dict[str, Any]]:
        """Yields results in any order. A request of None ends a batch, the cases that one thread computes together."""
        command = [self.path, "run", "--cases", "-", "--jobs", str(jobs), *(["--check"] if check else [])]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin is not None and process.stdout is not None and process.stderr is not None
            problems: List[BaseException] = []
            feeder = threading.Thread(target=_feed, args=(process.stdin, requests, problems), daemon=True)
            feeder.start()
            try:
                for line in process.stdout:
                    if line.endswith("\n"):  # an incomplete line means that the program was killed
                        yield json.loads(line)
            except BaseException:
                process.terminate()
                feeder.join()  # `requests` may still read the results file
                raise
            finally:
                process.stdout.close()
            if problems:
                raise problems[0]
            errors = process.stderr.read().strip()
            if process.wait() == 2:
                raise StartError(errors.removeprefix("lk-emu: "))
            if process.returncode not in (0, 1):
                raise Error(f"lk-emu run --cases ended with status {process.returncode}" + (f": {errors}" if errors else "") + "; --resume goes on")

    def scenario_text(self, request: Mapping[str, Any]) -> str:
        """Returns the case as a scenario file. Watched events are expectations after the scenario's own."""
        with tempfile.NamedTemporaryFile(suffix=".toml") as file:
            self._output("run", "--cases", "-", "--scenario", file.name, text=json.dumps(request))
            with open(file.name, encoding="utf-8") as written:
                return written.read()

    def _output(self, *arguments: str, text: str = "") -> str:
        done = subprocess.run([self.path, *arguments], input=text, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise StartError(done.stderr.strip().removeprefix("lk-emu: "))
        return done.stdout


def _feed(stream: Any, requests: Iterable[Optional[Mapping[str, Any]]], problems: List[BaseException]) -> None:
    try:
        with stream:
            for request in requests:
                stream.write("\n" if request is None else json.dumps(request) + "\n")
    except BrokenPipeError:
        pass  # the program has reported the reason
    except Exception as problem:  # raised by `requests`; re-raised in run()
        problems.append(problem)

"""Searches the output of a host program for lines that the plan counts as a detection."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Callable, Dict, List, Sequence

import regex

from ..errors import StartError

MAX_LINE = 2000  # bytes searched in a line
MAX_NOTICE = 500  # characters kept of a line
MAX_NOTICES = 1000
MAX_TAIL = 4096  # bytes kept of the end of the output
SEARCH_S = 1.0  # longest search of one line; a slower expression is refused
TRACEBACK = "Traceback (most recent call last):"
EXIT_STATUS = 0  # `rule` of a notice by exit status


@dataclass(frozen=True)
class Notice:
    at_ns: int  # since the start of the scenario
    text: str
    rule: int  # number of the expression, from 1; EXIT_STATUS for the exit status
    gist: str  # without numbers and paths, equal in all runs that print the line


def gist_of(line: str) -> str:
    """Returns the words without digits and slashes. Others may be times, ports or paths, which differ between runs."""
    return "".join(word + " " for word in line.split(" ") if not any(c.isdigit() or c == "/" for c in word))


class Output:
    def __init__(self, expressions: Sequence[str], now_ns: Callable[[], int]) -> None:
        self._expressions = [regex.compile(one) for one in expressions]
        self._now_ns = now_ns
        self._line = b""
        self._in_traceback = False
        self.bytes = 0
        self.tail = b""
        self.exception = ""  # line that names the exception of the last traceback
        self.exception_is_known = False  # an expression matches this line
        self.notices: List[Notice] = []

    def take(self, data: bytes) -> None:
        self.bytes += len(data)
        self.tail = (self.tail + data)[-MAX_TAIL:]
        *lines, rest = data.split(b"\n")
        for line in lines:
            self._search(self._line + line[:MAX_LINE])
            self._line = b""
        self._line = (self._line + rest)[:MAX_LINE]

    def finish(self) -> None:
        if self._line:
            self._search(self._line)

    def _search(self, data: bytes) -> None:
        line = data[:MAX_LINE].removesuffix(b"\r").decode(errors="replace")
        is_exception = self._is_exception(line)
        rule = next((n for n, one in enumerate(self._expressions, 1) if self._matches(one, line)), None)
        if is_exception:
            self.exception, self.exception_is_known = line[:MAX_NOTICE], rule is not None
        if rule is None or len(self.notices) >= MAX_NOTICES:
            return
        gist = gist_of(line)
        if all(gist != one.gist for one in self.notices):
            self.notices.append(Notice(self._now_ns(), line[:MAX_NOTICE], rule, gist))

    def _is_exception(self, line: str) -> bool:
        """True for the first line after the header of a traceback that is not indented."""
        if line == TRACEBACK:
            self._in_traceback = True
        elif self._in_traceback and line and not line[0].isspace():
            self._in_traceback = False
            return True
        return False

    @staticmethod
    def _matches(expression: Any, line: str) -> bool:
        try:
            return expression.search(line, timeout=SEARCH_S) is not None
        except TimeoutError:
            raise StartError(f'detect.host.says: "{expression.pattern}" takes too long to search a line; make it simpler') from None


def notices_json(notices: Sequence[Notice]) -> List[Dict[str, Any]]:
    return [asdict(one) for one in notices]

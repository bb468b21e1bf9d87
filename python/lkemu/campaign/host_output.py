"""What a host program says, and which lines mean that it has noticed something."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Callable, Dict, List, Sequence

import regex

from ..errors import StartError

MAX_LINE = 2000  # bytes of a line that are searched
MAX_NOTICE = 500  # characters that are kept of one
MAX_NOTICES = 1000
MAX_TAIL = 4096  # bytes of the end of the output that are kept
SEARCH_S = 1.0  # an expression that takes longer to search one line is refused
TRACEBACK = "Traceback (most recent call last):"
EXIT_STATUS = 0  # in place of the number of an expression


@dataclass(frozen=True)
class Notice:
    at_ns: int  # since the scenario began
    text: str
    rule: int  # which expression, from 1; EXIT_STATUS: its exit status
    gist: str  # what another run says too, if it says the same


def gist_of(line: str) -> str:
    """The words without digits and slashes, which are times, ports and paths."""
    return "".join(word + " " for word in line.split(" ") if not any(c.isdigit() or c == "/" for c in word))


class Output:
    def __init__(self, expressions: Sequence[str], now_ns: Callable[[], int]) -> None:
        self._expressions = [regex.compile(one) for one in expressions]
        self._now_ns = now_ns
        self._line = b""
        self._in_traceback = False
        self.bytes = 0
        self.tail = b""
        self.exception = ""  # the line of Python that tells the last one that was not caught
        self.exception_is_known = False  # an expression is found in it
        self.notices: List[Notice] = []

    def take(self, data: bytes) -> None:
        self.bytes += len(data)
        self.tail = (self.tail + data)[-MAX_TAIL:]
        *lines, rest = data.split(b"\n")
        for line in lines:
            self._look(self._line + line[:MAX_LINE])
            self._line = b""
        self._line = (self._line + rest)[:MAX_LINE]

    def finish(self) -> None:
        if self._line:
            self._look(self._line)

    def _look(self, data: bytes) -> None:
        line = data[:MAX_LINE].removesuffix(b"\r").decode(errors="replace")
        is_exception = self._is_exception(line)
        rule = next((n for n, one in enumerate(self._expressions, 1) if self._found(one, line)), None)
        if is_exception:
            self.exception, self.exception_is_known = line[:MAX_NOTICE], rule is not None
        if rule is None or len(self.notices) >= MAX_NOTICES:
            return
        gist = gist_of(line)
        if all(gist != one.gist for one in self.notices):
            self.notices.append(Notice(self._now_ns(), line[:MAX_NOTICE], rule, gist))

    def _is_exception(self, line: str) -> bool:
        """Behind the head of a traceback: the first line that is not indented."""
        if line == TRACEBACK:
            self._in_traceback = True
        elif self._in_traceback and line and not line[0].isspace():
            self._in_traceback = False
            return True
        return False

    @staticmethod
    def _found(expression: Any, line: str) -> bool:
        try:
            return expression.search(line, timeout=SEARCH_S) is not None
        except TimeoutError:
            raise StartError(f'detect.host.says: "{expression.pattern}" takes too long to search a line; make it simpler') from None


def notices_json(notices: Sequence[Notice]) -> List[Dict[str, Any]]:
    return [asdict(one) for one in notices]

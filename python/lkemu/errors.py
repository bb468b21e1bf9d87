"""Exceptions of this package, with messages of one line."""

from __future__ import annotations


class Error(Exception):
    """Base of all exceptions of this package."""


class StartError(Error):
    """lk-emu could not be started; the text says what to do."""


class Refused(Error):
    """lk-emu refused a request and did nothing.

    `where` is the offending part of the request, `reason` the mistake in it.
    """

    def __init__(self, where: str, reason: str, status: int = 400) -> None:
        super().__init__(f"{where}: {reason}" if where else reason)
        self.where = where
        self.reason = reason
        self.status = status  # HTTP status


class Ended(Error):
    """lk-emu ended or stopped answering during a request."""


class NoReply(Error, AssertionError):
    """A host waited longer than the patience of its SteppedBus. Without this limit it would wait for ever."""


class NoEffect(Error, AssertionError):
    """A fault was set but never had an effect, so the test has shown nothing."""

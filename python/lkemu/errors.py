"""What can go wrong, one line each."""

from __future__ import annotations


class Error(Exception):
    """Anything this package raises itself."""


class StartError(Error):
    """lk-emu could not be started; the text says what to do."""


class Refused(Error):
    """lk-emu did not take a request: nothing was done.

    `where` is the part of the request that is meant, `reason` what is wrong with it.
    """

    def __init__(self, where: str, reason: str, status: int = 400) -> None:
        super().__init__(f"{where}: {reason}" if where else reason)
        self.where = where
        self.reason = reason
        self.status = status  # of HTTP


class Ended(Error):
    """lk-emu ended, or stopped answering, while it was needed."""


class NoReply(Error, AssertionError):
    """A host has waited longer than a SteppedBus lets it: without this it would wait for ever."""


class NoEffect(Error, AssertionError):
    """A fault was set and nothing was ever otherwise because of it: the test has shown nothing."""

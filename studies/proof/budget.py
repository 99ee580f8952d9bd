"""A budget of processor time: what a proof does in its blocks ends when it is used up."""

from __future__ import annotations

import math
import signal
import time
from contextlib import suppress
from types import TracebackType
from typing import Any

#: seconds after which the signal comes again, where a library has swallowed the first one
AGAIN = 0.5


class OutOfTime(BaseException):
    """The processor time is used up; no `Exception`, so that no formula of a user's catches it."""


class Budget:
    """Seconds of processor time for all blocks `with budget:`; raises `OutOfTime` in them.

    A block is not begun when nothing is left, and ends between two steps of Python by the timer of
    the system; where there is none (Windows), or outside of the main thread, it goes on to its end.
    """

    def __init__(self, seconds: float) -> None:
        self.left = seconds
        self._begun, self._inside = 0.0, False
        self._before: list[Any] = []  # the handler; None is one that Python did not set

    def __enter__(self) -> Budget:
        if self.left <= 0:
            raise OutOfTime
        self._begun, self._inside = time.process_time(), True
        if self.left < math.inf and hasattr(signal, "setitimer"):
            with suppress(ValueError):  # outside of the main thread
                self._before = [signal.signal(signal.SIGPROF, self._stop)]
                signal.setitimer(signal.ITIMER_PROF, self.left, AGAIN)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self._inside = False
        if self._before:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.signal(signal.SIGPROF, self._before.pop() or signal.SIG_DFL)
        # the timer may be a tick before the clock
        self.left -= self.left if kind is OutOfTime else time.process_time() - self._begun

    def _stop(self, number: int, frame: Any) -> None:
        if self._inside:
            raise OutOfTime

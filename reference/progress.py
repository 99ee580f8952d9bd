"""The progress of a computation, sent to a listener."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

Show = Callable[[str, float], None]

_listener: ContextVar[Show | None] = ContextVar("listener", default=None)


@contextmanager
def progress_to(show: Show) -> Iterator[None]:
    """Call show(label, fraction) at each step of an integration within this context."""
    token = _listener.set(show)
    try:
        yield
    finally:
        _listener.reset(token)


def tell(label: str, now: Any, goal: Any) -> None:
    """Report the time ``now`` on the way from 0 to ``goal``, gmpy2 numbers of any size."""
    import gmpy2

    show = _listener.get()
    if show is not None:
        share = min(1.0, abs(float(now / goal))) if goal else 1.0
        show(f"{label}, t = {gmpy2.mpfr(now):.3g}", share)

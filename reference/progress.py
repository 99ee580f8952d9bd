"""How far a computation is, told to whoever listens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Show = Callable[[str, float], None]

_listener: ContextVar[Show | None] = ContextVar("listener", default=None)


@contextmanager
def progress_to(show: Show) -> Iterator[None]:
    """While this lasts, show(label, fraction) is called at each step of an integration."""
    token = _listener.set(show)
    try:
        yield
    finally:
        _listener.reset(token)


def tell(label: str, now: float, goal: float) -> None:
    """At the time ``now`` on the way from 0 to ``goal``."""
    show = _listener.get()
    if show is not None:
        show(f"{label}, t = {now:.3g}", min(1.0, abs(now / goal)) if goal else 1.0)

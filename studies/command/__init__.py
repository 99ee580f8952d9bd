"""The command `discmech`."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.environment import collect_rarely, one_thread
from .last_words import close_streams, open_streams, told
from .watched import watched

__all__ = ["main"]

INTERRUPTED = 130  # the exit code of shells: 128 + SIGINT


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command (`entry.main`); an interrupt while it is loaded ends it, too."""
    if arguments is not None:
        return _run(arguments)
    open_streams()  # only in its own process
    try:
        return watched(_own)
    except OSError as error:  # the system has no process left
        return told(error)


def _own() -> int:
    collect_rarely()
    return close_streams(_run(None))


def _run(arguments: Sequence[str] | None) -> int:
    try:
        with one_thread():
            from .entry import main as run

            return run(arguments)
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        return told(error)

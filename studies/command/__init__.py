"""The command `discmech`."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.environment import collect_rarely, one_thread
from .last_words import close_streams, open_streams, told

__all__ = ["main"]

INTERRUPTED = 130  # the exit code of shells: 128 + SIGINT


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command (`entry.main`); an interrupt while it is loaded ends it, too."""
    try:
        if arguments is not None:
            return _run(arguments)
        open_streams()  # only in its own process
        collect_rarely()
        return close_streams(_run(None))
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        return told(error)


def _run(arguments: Sequence[str] | None) -> int:
    with one_thread():
        from .entry import main as run

        return run(arguments)

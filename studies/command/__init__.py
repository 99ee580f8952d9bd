"""The command `discmech`."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.environment import collect_rarely, one_thread

__all__ = ["main"]

INTERRUPTED = 130  # as shells have it: 128 + SIGINT


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command (`entry.main`), also where it is interrupted while it is being loaded."""
    try:
        with one_thread():
            if arguments is None:  # a process of its own
                collect_rarely()
            from .entry import main as run

            return run(arguments)
    except KeyboardInterrupt:
        return INTERRUPTED

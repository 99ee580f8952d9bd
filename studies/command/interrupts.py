"""A signal to stop ends the command soon, whatever it or its workers are at."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import active_children
from threading import Thread, current_thread, main_thread
from typing import Any

PATIENCE = 1.5  # seconds after which what does not end by itself is ended
#: signals that ask a process to end: of Ctrl-C, of who runs it, of a terminal that closes
STOPS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
GOES_ON = "; the same command goes on where it stopped"
GOES_ON_FRESH = "; without --fresh the same command goes on where it stopped"


class Farewell:
    """The last sentence, said once by whoever comes first, and the exit code.

    again: how what was measured is of use to the next run.
    """

    again = ""
    said = False
    code = 128 + signal.SIGINT  # as shells have it

    def say(self) -> None:
        """Say it on standard error."""
        if not self.said:
            self.said = True
            with suppress(OSError, ValueError):  # nobody can be told
                clear = (
                    "\r\x1b[2K\x1b[?25h" if sys.stderr.isatty() else ""
                )  # a bar hides the cursor
                print(f"{clear}discmech: interrupted{self.again}.", file=sys.stderr, flush=True)


@contextmanager
def ended_soon() -> Iterator[Farewell]:
    """Ends the process PATIENCE seconds after a signal to stop that did not end it.

    Python raises KeyboardInterrupt between two of its own steps, for all of these signals: machine
    code may be long at one, and a library may swallow it. So another thread is told of the signal
    as well. Workers are killed; what was finished is kept case by case, and files are written
    beside and then renamed.
    """
    farewell = Farewell()
    if current_thread() is not main_thread():
        yield farewell
        return

    def stop(number: int, frame: Any) -> None:
        farewell.code = 128 + number
        raise KeyboardInterrupt

    told, teller = socket.socketpair()
    teller.setblocking(False)
    before = signal.set_wakeup_fd(teller.fileno(), warn_on_full_buffer=False)
    # one that is ignored (nohup) stays so, and SIGINT is Python's own already
    own = {number: signal.signal(number, stop) for number in STOPS[1:]
           if signal.getsignal(number) is signal.SIG_DFL}  # fmt: skip
    Thread(target=_watch, args=(told, farewell), daemon=True).start()
    try:
        yield farewell
    finally:
        signal.set_wakeup_fd(before)
        for number, handler in own.items():
            signal.signal(number, handler)


def _watch(told: socket.socket, farewell: Farewell) -> None:
    while not {*STOPS} & {*(signals := told.recv(1))}:
        if not signals:  # nobody can tell any more
            return
    time.sleep(PATIENCE)
    for worker in active_children():
        worker.kill()
    farewell.say()
    os._exit(128 + signals[0])

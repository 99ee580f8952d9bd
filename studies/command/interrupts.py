"""A stop signal ends the command soon, whatever it or its workers are doing."""

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

from .watched import STOPS

PATIENCE = 1.5  # seconds after which the process is ended
GOES_ON = "; the same command goes on where it stopped"
GOES_ON_FRESH = "; without --fresh the same command goes on where it stopped"


class Farewell:
    """The last sentence, printed once by the first caller, and the exit code.

    again: how the next run can use the measurements.
    """

    again = ""
    said = False
    code = 128 + signal.SIGINT  # the exit code of shells

    def say(self) -> None:
        """Print the sentence on standard error."""
        if not self.said:
            self.said = True
            with suppress(OSError, ValueError):  # standard error is closed
                clear = (
                    "\r\x1b[2K\x1b[?25h" if sys.stderr.isatty() else ""
                )  # a progress bar hides the cursor
                print(f"{clear}discmech: interrupted{self.again}.", file=sys.stderr, flush=True)


@contextmanager
def ended_soon() -> Iterator[Farewell]:
    """End the process PATIENCE seconds after a stop signal that did not end it.

    For all these signals Python raises KeyboardInterrupt between two of its own steps, but machine
    code may take long, and a library may swallow the exception. So another thread is notified as
    well. Only the first signal counts: a terminal sends it to this process, and the one that
    watches it (`watched`) passes it on. Workers are killed; finished cases are kept, and files are
    written to a new name and then renamed.
    """
    farewell = Farewell()
    if current_thread() is not main_thread():
        yield farewell
        return

    def stop(number: int, frame: Any) -> None:
        for each in own:
            signal.signal(each, signal.SIG_IGN)
        own.clear()
        farewell.code = 128 + number
        raise KeyboardInterrupt

    told, teller = socket.socketpair()
    teller.setblocking(False)
    before = signal.set_wakeup_fd(teller.fileno(), warn_on_full_buffer=False)
    # an ignored signal (nohup) stays ignored
    usual = (signal.SIG_DFL, signal.default_int_handler)
    own = {n: signal.signal(n, stop) for n in STOPS if signal.getsignal(n) in usual}
    Thread(target=_watch, args=(told, farewell), daemon=True).start()
    try:
        yield farewell
    finally:
        signal.set_wakeup_fd(before)
        for number, handler in own.items():
            signal.signal(number, handler)


def _watch(told: socket.socket, farewell: Farewell) -> None:
    while not {*STOPS} & {*(signals := told.recv(1))}:
        if not signals:  # the sockets are closed
            return
    time.sleep(PATIENCE)
    for worker in active_children():
        worker.kill()
    farewell.say()
    os._exit(128 + signals[0])

"""An interrupt ends the command soon, whatever it or its workers are at."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import active_children
from threading import Thread, current_thread, main_thread

PATIENCE = 1.5  # seconds after which what does not end by itself is ended


class Farewell:
    """The last sentence, said once by whoever comes first; `kept`: what it measured is kept."""

    kept = False
    said = False

    def say(self) -> None:
        """Say it on standard error."""
        if not self.said:
            self.said = True
            clear = "\r\x1b[2K\x1b[?25h" if sys.stderr.isatty() else ""  # a bar hides the cursor
            again = "; the same command goes on where it stopped" if self.kept else ""
            print(f"{clear}discmech: interrupted{again}.", file=sys.stderr, flush=True)


@contextmanager
def ended_soon(code: int) -> Iterator[Farewell]:
    """Ends the process with that code, PATIENCE seconds after an interrupt that did not end it.

    Python raises KeyboardInterrupt between two of its own steps: machine code may be long at one,
    and a library may swallow it. So another thread is told of the signal as well. Workers are
    killed; what was finished is kept case by case, and files are written beside and then renamed.
    """
    farewell = Farewell()
    if current_thread() is not main_thread():
        yield farewell
        return
    told, teller = socket.socketpair()
    teller.setblocking(False)
    before = signal.set_wakeup_fd(teller.fileno(), warn_on_full_buffer=False)
    Thread(target=_watch, args=(told, code, farewell), daemon=True).start()
    try:
        yield farewell
    finally:
        signal.set_wakeup_fd(before)


def _watch(told: socket.socket, code: int, farewell: Farewell) -> None:
    while signal.SIGINT not in (signals := told.recv(1)):
        if not signals:  # nobody can tell any more
            return
    time.sleep(PATIENCE)
    for worker in active_children():
        worker.kill()
    farewell.say()
    os._exit(code)

"""The command runs in a process that the first one watches: its exit code is what the command said.

Whatever the command runs may end its process: the exit(0) of a C library (STOP in Fortran),
`os._exit` in a rule, a crash of machine code. Its exit code then is no verdict. So the command
says its own one at its end, and whoever did not come there ends with 4.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from threading import Thread

from .last_words import COULD_NOT_RUN

#: signals that ask a process to end: Ctrl-C, a supervisor, a closed terminal
STOPS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def watched(command: Callable[[], int]) -> int:
    """Call the command in a forked process, and return its exit code there.

    This process ends with the same code, or with 4 and a sentence if the other one ended before.
    Stop signals are passed on, and the other process ends with this one. It must be called before
    there are threads; where the system cannot fork, the command is only called.
    """
    if not hasattr(os, "fork"):
        return command()
    ours, theirs = socket.socketpair()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)  # until both are ready for them
    number = os.fork()
    if number:
        theirs.close()

        def pass_on(which: int, _: object) -> None:
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(number, which)

        for each in STOPS:
            if signal.getsignal(each) is not signal.SIG_IGN:  # nohup
                signal.signal(each, pass_on)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        os._exit(_code(os.waitpid(number, 0)[1], ours))  # the rest is the other process's task
    ours.close()
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    Thread(target=_end_with, args=(theirs,), daemon=True).start()
    try:
        code = command()
    except SystemExit as end:  # argparse's, for --help and wrong words
        code = int(end.code or 0)
    theirs.send(bytes([code]))
    return code


def _end_with(first: socket.socket) -> None:
    """End this process as soon as the first one has ended."""
    if not first.recv(1):
        os._exit(COULD_NOT_RUN)


def _code(status: int, told: socket.socket) -> int:
    """Return the exit code of the command; told: where it says it."""
    told.setblocking(False)  # a process that was left behind may hold the other end
    try:
        if said := told.recv(1):
            return said[0]
    except BlockingIOError:
        pass
    code = os.waitstatus_to_exitcode(status)
    for each in STOPS:
        if code in (-each, 128 + each):
            return 128 + each
    how = f"with exit code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"
    print(
        f"discmech: the process of the command ended {how} before the command did, so there is no "
        "verdict: something that it ran calls exit, or crashed; or there is too little memory.",
        file=sys.stderr, flush=True,
    )  # fmt: skip
    return COULD_NOT_RUN
